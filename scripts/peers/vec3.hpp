// Vectors of three numbers, with the operations of cameras and transforms.
#pragma once

#include <cmath>

template <class T>
struct Vec3 {
    T x, y, z;
};

using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;

template <class T>
inline Vec3<T> operator+(Vec3<T> a, Vec3<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class T>
inline Vec3<T> operator-(Vec3<T> a, Vec3<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class T>
inline Vec3<T> operator*(Vec3<T> a, T s) { return {a.x * s, a.y * s, a.z * s}; }
template <class T>
inline T dot(Vec3<T> a, Vec3<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T>
inline Vec3<T> normalize(Vec3<T> a) { return a * (T(1) / std::sqrt(dot(a, a))); }
template <class T>
inline Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Vec3f to_float(Vec3d a) { return {float(a.x), float(a.y), float(a.z)}; }

// Columns of a linear map, and its translation.
struct Affine {
    Vec3d x, y, z, origin;

    static Affine identity() { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}; }

    Vec3d linear(Vec3d p) const { return x * p.x + y * p.y + z * p.z; }
    Vec3d point(Vec3d p) const { return linear(p) + origin; }

    // Turns normals up to their length: the cofactors of the linear part.
    Affine normals() const { return {cross(y, z), cross(z, x), cross(x, y), {0, 0, 0}}; }

    bool only_moves() const {
        auto is = [](Vec3d a, double x, double y, double z) { return a.x == x && a.y == y && a.z == z; };
        return is(x, 1, 0, 0) && is(y, 0, 1, 0) && is(z, 0, 0, 1);
    }
};
