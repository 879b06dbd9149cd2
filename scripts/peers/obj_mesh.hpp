// Positions and triangles of an OBJ file. Polygons become fans; normals, texture coordinates and materials are ignored.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "vec3.hpp"

struct ObjMesh {
    std::vector<Vec3d> positions;
    std::vector<uint32_t> indices;
};

inline ObjMesh read_obj(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    ObjMesh mesh;
    std::vector<uint32_t> face;
    for (const char* at = text.c_str(); *at;) {
        const char* line = at;
        while (*at && *at != '\n') ++at;
        const char* end = at;
        if (*at) ++at;
        if (line[0] == 'v' && line[1] == ' ') {
            char* next = const_cast<char*>(line + 1);
            Vec3d p{};
            p.x = std::strtod(next, &next), p.y = std::strtod(next, &next), p.z = std::strtod(next, &next);
            mesh.positions.push_back(p);
        } else if (line[0] == 'f' && line[1] == ' ') {
            face.clear();
            for (const char* p = line + 1; p < end;) {
                char* next;
                const long index = std::strtol(p, &next, 10);
                if (next == p || next > end) break;
                // Counted from one, or backwards from the last position.
                const long from_zero = index < 0 ? long(mesh.positions.size()) + index : index - 1;
                if (from_zero < 0 || from_zero >= long(mesh.positions.size()))
                    throw std::runtime_error(path + ": a face names a position that does not exist");
                face.push_back(uint32_t(from_zero));
                for (p = next; p < end && *p != ' ';) ++p;
            }
            for (size_t i = 2; i < face.size(); ++i)
                mesh.indices.insert(mesh.indices.end(), {face[0], face[i - 1], face[i]});
        }
    }
    return mesh;
}
