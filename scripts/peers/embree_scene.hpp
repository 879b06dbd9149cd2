// The workload for Embree. A mesh with one instance without a transform is a geometry of the top scene; every other mesh is a
// scene with instances in the top scene.
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "obj_mesh.hpp"
#include "scene_text.hpp"

static_assert(RTC_MAX_INSTANCE_LEVEL_COUNT == 1, "one level of instances is expected");

struct EmbreeOptions {
    RTCBuildQuality quality = RTC_BUILD_QUALITY_HIGH;
    // Scene triangles (the ground) belong to the picture, not to the measurement of single rays.
    bool with_triangles = true;
    std::string device;
};

// Surface of a top-level geometry. `normals` transforms the normals of an instance's mesh.
struct Surface {
    Material material;
    Vec3f normals[3];
};

class EmbreeScene {
  public:
    EmbreeScene(const SceneText& text, const EmbreeOptions& options)
        : device_(rtcNewDevice(options.device.c_str())), quality_(options.quality) {
        if (!device_) throw std::runtime_error("Embree: no device for \"" + options.device + "\"");
        rtcSetDeviceErrorFunction(device_, fail, nullptr);
        top = new_scene();
        std::vector<size_t> uses(text.meshes.size());
        for (const Instance& instance : text.instances) ++uses[instance.mesh];
        std::vector<ObjMesh> meshes;
        for (const std::string& path : text.meshes) meshes.push_back(read_obj(path));
        std::vector<RTCScene> scenes(meshes.size(), nullptr);
        for (const Instance& instance : text.instances) {
            const ObjMesh& mesh = meshes[instance.mesh];
            const Affine& to_world = instance.to_world;
            for (Vec3d p : mesh.positions) include(to_world.point(p));
            const bool as_it_is = uses[instance.mesh] == 1 && to_world.only_moves() &&
                                  dot(to_world.origin, to_world.origin) == 0;
            RTCGeometry geometry;
            if (as_it_is) {
                geometry = triangles(mesh);
            } else {
                if (!scenes[instance.mesh]) scenes[instance.mesh] = scene_of(mesh);
                geometry = instance_of(scenes[instance.mesh], to_world);
                has_instances = true;
                turned_normals |= !to_world.only_moves();
            }
            attach(geometry, text.materials[instance.material], to_world.normals());
        }
        if (options.with_triangles) {
            for (size_t material = 0; material < text.materials.size(); ++material) {
                ObjMesh mesh;
                for (const Triangle& triangle : text.triangles[material])
                    for (Vec3d corner : triangle.corners) {
                        mesh.indices.push_back(uint32_t(mesh.positions.size()));
                        mesh.positions.push_back(corner);
                    }
                if (!mesh.indices.empty()) attach(triangles(mesh), text.materials[material], Affine::identity());
            }
        }
        rtcCommitScene(top);
    }

    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    ~EmbreeScene() {
        rtcReleaseScene(top);
        for (RTCScene scene : instanced_) rtcReleaseScene(scene);
        rtcReleaseDevice(device_);
    }

    RTCScene top = nullptr;
    // Indexed by the geometry id in the top scene, which for an instance is the instance id.
    std::vector<Surface> surfaces;
    bool has_instances = false;
    // Whether the normals of an instance need a transform to the world.
    bool turned_normals = false;
    // The world bounding box of the models, without the scene's own triangles.
    Vec3d lower{1e300, 1e300, 1e300}, upper{-1e300, -1e300, -1e300};

  private:
    static void fail(void*, RTCError, const char* message) {
        throw std::runtime_error(std::string("Embree: ") + (message ? message : "an error without words"));
    }

    void include(Vec3d p) {
        lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
        upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
    }

    RTCScene new_scene() {
        RTCScene scene = rtcNewScene(device_);
        rtcSetSceneBuildQuality(scene, quality_);
        return scene;
    }

    RTCScene scene_of(const ObjMesh& mesh) {
        RTCScene scene = new_scene();
        RTCGeometry geometry = triangles(mesh);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        instanced_.push_back(scene);
        return scene;
    }

    RTCGeometry triangles(const ObjMesh& mesh) {
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), mesh.positions.size()));
        for (size_t i = 0; i < mesh.positions.size(); ++i) positions[i] = to_float(mesh.positions[i]);
        auto* indices = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t),
                                    mesh.indices.size() / 3));
        std::copy(mesh.indices.begin(), mesh.indices.end(), indices);
        rtcSetGeometryBuildQuality(geometry, quality_);
        rtcCommitGeometry(geometry);
        return geometry;
    }

    RTCGeometry instance_of(RTCScene scene, const Affine& to_world) {
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, scene);
        const Vec3f columns[4] = {to_float(to_world.x), to_float(to_world.y), to_float(to_world.z),
                                  to_float(to_world.origin)};
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
        rtcCommitGeometry(geometry);
        return geometry;
    }

    void attach(RTCGeometry geometry, const Material& material, const Affine& normals) {
        const unsigned id = rtcAttachGeometry(top, geometry);
        rtcReleaseGeometry(geometry);
        surfaces.resize(id + 1);
        surfaces[id] = {material, {to_float(normals.x), to_float(normals.y), to_float(normals.z)}};
    }

    RTCDevice device_;
    RTCBuildQuality quality_;
    std::vector<RTCScene> instanced_;
};
