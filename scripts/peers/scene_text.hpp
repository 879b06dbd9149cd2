// The scene as prepare_scene.py writes it: a word a line, then its numbers.
#pragma once

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "vec3.hpp"

struct Material {
    Vec3f diffuse, specular;
    float exponent;
};

struct Triangle {
    Vec3d corners[3];
};

struct Instance {
    size_t mesh, material;
    Affine to_world;
};

struct SceneText {
    int width = 0, height = 0, samples = 1;
    Vec3d position{}, look_at{}, up{};
    double fov = 0;
    Vec3f background{}, ambient{};
    Vec3d light{};
    Vec3f radiance{};
    std::vector<Material> materials;
    // Indexed by material.
    std::vector<std::vector<Triangle>> triangles;
    std::vector<std::string> meshes;
    std::vector<Instance> instances;
};

inline SceneText read_scene_text(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    SceneText scene;
    std::string line;
    for (int number = 1; std::getline(file, line); ++number) {
        std::istringstream text(line);
        std::string word;
        text >> word;
        auto d3 = [&](Vec3d& v) { text >> v.x >> v.y >> v.z; };
        auto f3 = [&](Vec3f& v) { text >> v.x >> v.y >> v.z; };
        if (word == "size") {
            text >> scene.width >> scene.height >> scene.samples;
        } else if (word == "camera") {
            d3(scene.position), d3(scene.look_at), d3(scene.up);
            text >> scene.fov;
        } else if (word == "background") {
            f3(scene.background);
        } else if (word == "ambient") {
            f3(scene.ambient);
        } else if (word == "light") {
            d3(scene.light), f3(scene.radiance);
        } else if (word == "material") {
            Material material{};
            f3(material.diffuse), f3(material.specular);
            text >> material.exponent;
            scene.materials.push_back(material);
            scene.triangles.emplace_back();
        } else if (word == "triangle") {
            size_t material = 0;
            Triangle triangle{};
            text >> material;
            for (Vec3d& corner : triangle.corners) d3(corner);
            scene.triangles.at(material).push_back(triangle);
        } else if (word == "mesh") {
            scene.meshes.push_back(line.substr(5));
            continue;
        } else if (word == "instance") {
            Instance instance{};
            text >> instance.mesh >> instance.material;
            Affine& a = instance.to_world;
            for (Vec3d* column : {&a.x, &a.y, &a.z, &a.origin}) d3(*column);
            if (instance.mesh >= scene.meshes.size() || instance.material >= scene.materials.size())
                text.setstate(std::ios::failbit);
            scene.instances.push_back(instance);
        } else {
            text.setstate(std::ios::failbit);
        }
        if (!text) throw std::runtime_error(path + ":" + std::to_string(number) + ": not a line of a scene");
    }
    return scene;
}
