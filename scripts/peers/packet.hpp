// Sixteen rays from the eye: hits, shadows and colours.
//
// Blinn-Phong shading with flat normals that face the viewer and one point light without attenuation:
//   I = c_d I_a + S I_l ( c_d max(0, N.L) + c_s max(0, N.H)^p )
// Shading is one loop over the lanes, which the compiler vectorises.
#pragma once

#include "embree_scene.hpp"
#include "lanes.hpp"

// Distance of a shadow ray from its surface / (distance of the point from the origin + from the eye): about thirty times the
// rounding of single precision.
constexpr float SHADOW_BIAS = 4e-6f;

// Directions of a packet's rays, not of unit length.
struct Directions {
    Lanes x, y, z;
};

class PacketTracer {
  public:
    PacketTracer(const SceneText& text, const EmbreeScene& scene)
        : scene_(scene),
          eye_(to_float(text.position)),
          light_(to_float(text.light)),
          radiance_(text.radiance),
          ambient_(text.ambient),
          background_(text.background) {
        rtcInitIntersectContext(&eye_context_);
        rtcInitIntersectContext(&shadow_context_);
        eye_context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        // With this flag and instances, rtcOccluded16 of Embree 3.13.5 never returns, at any level of SIMD.
        if (!scene.has_instances) shadow_context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }

    // Adds the linear colours of sixteen rays to `out`; returns the number of shadow rays.
    int trace(const Directions& directions, Colors& out) {
        RTCRayHit16 rays;
        start(directions, rays);
        rtcIntersect16(ALL, scene_.top, &eye_context_, &rays);
        unsigned first = RTC_INVALID_GEOMETRY_ID;
        const Seen seen = what_is_seen(rays, first);
        if (seen == Seen::nothing) {
            for (int i = 0; i < LANES; ++i) {
                out.r[i] += background_.x, out.g[i] += background_.y, out.b[i] += background_.z;
            }
            return 0;
        }
        if (seen == Seen::several)
            return scene_.turned_normals ? shade<false, true>(rays, first, out) : shade<false, false>(rays, first, out);
        return scene_.turned_normals ? shade<true, true>(rays, first, out) : shade<true, false>(rays, first, out);
    }

  private:
    enum class Seen { nothing, one_surface, several };

    alignas(64) static constexpr int ALL[LANES] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};

    void start(const Directions& directions, RTCRayHit16& rays) const {
        for (int i = 0; i < LANES; ++i) {
            rays.ray.org_x[i] = eye_.x, rays.ray.org_y[i] = eye_.y, rays.ray.org_z[i] = eye_.z;
            rays.ray.dir_x[i] = directions.x[i];
            rays.ray.dir_y[i] = directions.y[i];
            rays.ray.dir_z[i] = directions.z[i];
            rays.ray.tnear[i] = 0.0f;
            rays.ray.tfar[i] = 1e30f;
            rays.ray.mask[i] = ~0u;
            rays.ray.time[i] = 0.0f;
            rays.ray.flags[i] = 0;
            // Embree leaves the normal of a ray that misses, and Debian's build checks the shadow rays of such lanes too.
            rays.hit.Ng_x[i] = 0.0f, rays.hit.Ng_y[i] = 0.0f, rays.hit.Ng_z[i] = 1.0f;
            rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
    }

    // Stores the surface of each lane in `instID`; `first` is the surface with the lowest number.
    static Seen what_is_seen(RTCRayHit16& rays, unsigned& first) {
        unsigned* surface = rays.hit.instID[0];
        const unsigned* geometry = rays.hit.geomID;
        unsigned lowest = RTC_INVALID_GEOMETRY_ID, highest = 0;
        for (int i = 0; i < LANES; ++i) {
            surface[i] = surface[i] == RTC_INVALID_GEOMETRY_ID ? geometry[i] : surface[i];
            // A ray that missed has the highest possible number.
            lowest = surface[i] < lowest ? surface[i] : lowest;
            const unsigned if_hit = surface[i] == RTC_INVALID_GEOMETRY_ID ? 0 : surface[i];
            highest = if_hit > highest ? if_hit : highest;
        }
        first = lowest;
        if (lowest == RTC_INVALID_GEOMETRY_ID) return Seen::nothing;
        return lowest == highest ? Seen::one_surface : Seen::several;
    }

    // Of each lane's surface.
    struct LaneSurfaces {
        Lanes diffuse[3], specular[3], exponent, normals[3][3];
    };

    // Copied lane by lane, so that the loop that shades reads all lanes in order and stays one of vectors.
    template <bool TURNED>
    LaneSurfaces copy_surfaces(const RTCRayHit16& rays, unsigned first) const {
        LaneSurfaces lanes;
        for (int i = 0; i < LANES; ++i) {
            const unsigned id = rays.hit.instID[0][i];
            const Surface& surface = scene_.surfaces[id == RTC_INVALID_GEOMETRY_ID ? first : id];
            const Material& material = surface.material;
            lanes.diffuse[0][i] = material.diffuse.x, lanes.specular[0][i] = material.specular.x;
            lanes.diffuse[1][i] = material.diffuse.y, lanes.specular[1][i] = material.specular.y;
            lanes.diffuse[2][i] = material.diffuse.z, lanes.specular[2][i] = material.specular.z;
            lanes.exponent[i] = material.exponent;
            for (int column = 0; TURNED && column < 3; ++column) {
                lanes.normals[column][0][i] = surface.normals[column].x;
                lanes.normals[column][1][i] = surface.normals[column].y;
                lanes.normals[column][2][i] = surface.normals[column].z;
            }
        }
        return lanes;
    }

    static Vec3f at(const Lanes* lanes, int i) { return {lanes[0][i], lanes[1][i], lanes[2][i]}; }

    template <bool ONE_SURFACE, bool TURNED>
    int shade(const RTCRayHit16& rays, unsigned first, Colors& out) {
        const Surface one = scene_.surfaces[first];
        LaneSurfaces several;
        if (!ONE_SURFACE) several = copy_surfaces<TURNED>(rays, first);
        alignas(64) int lit[LANES];
        RTCRay16 shadow;
        Colors from_light, always;
        int count = 0;
        for (int i = 0; i < LANES; ++i) {
            const bool hit = rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
            const Material& material = one.material;
            const Vec3f diffuse = ONE_SURFACE ? material.diffuse : at(several.diffuse, i);
            const Vec3f specular = ONE_SURFACE ? material.specular : at(several.specular, i);
            const float exponent = ONE_SURFACE ? material.exponent : several.exponent[i];
            const float t = hit ? rays.ray.tfar[i] : 0.0f;
            const float dx = rays.ray.dir_x[i], dy = rays.ray.dir_y[i], dz = rays.ray.dir_z[i];
            const float px = eye_.x + t * dx, py = eye_.y + t * dy, pz = eye_.z + t * dz;

            float nx = rays.hit.Ng_x[i], ny = rays.hit.Ng_y[i], nz = rays.hit.Ng_z[i];
            if (TURNED) {
                const Vec3f a = ONE_SURFACE ? one.normals[0] : at(several.normals[0], i);
                const Vec3f b = ONE_SURFACE ? one.normals[1] : at(several.normals[1], i);
                const Vec3f c = ONE_SURFACE ? one.normals[2] : at(several.normals[2], i);
                const float x = a.x * nx + b.x * ny + c.x * nz;
                const float y = a.y * nx + b.y * ny + c.y * nz;
                const float z = a.z * nx + b.z * ny + c.z * nz;
                nx = x, ny = y, nz = z;
            }
            const float n_dot_d = nx * dx + ny * dy + nz * dz;
            const float n_length = 1.0f / std::sqrt(nx * nx + ny * ny + nz * nz);
            const float to_unit = n_dot_d > 0.0f ? -n_length : n_length;
            nx *= to_unit, ny *= to_unit, nz *= to_unit;

            const float tx = light_.x - px, ty = light_.y - py, tz = light_.z - pz;
            const float to_light = 1.0f / std::sqrt(tx * tx + ty * ty + tz * tz);
            const float lx = tx * to_light, ly = ty * to_light, lz = tz * to_light;
            const float d_squared = dx * dx + dy * dy + dz * dz;
            const float to_viewer = 1.0f / std::sqrt(d_squared);
            const float hx = lx - dx * to_viewer, hy = ly - dy * to_viewer, hz = lz - dz * to_viewer;
            const float n_dot_l = nx * lx + ny * ly + nz * lz;
            const float n_dot_h = (nx * hx + ny * hy + nz * hz) / std::sqrt(hx * hx + hy * hy + hz * hz);
            const float inside = n_dot_h > 0.0f ? n_dot_h : 0.0f;
            const float highlight = power(inside < 1.0f ? inside : 1.0f, exponent);

            const bool facing = hit & (n_dot_l > 0.0f);
            lit[i] = facing ? -1 : 0;
            count += facing;
            from_light.r[i] = radiance_.x * (diffuse.x * n_dot_l + specular.x * highlight);
            from_light.g[i] = radiance_.y * (diffuse.y * n_dot_l + specular.y * highlight);
            from_light.b[i] = radiance_.z * (diffuse.z * n_dot_l + specular.z * highlight);
            always.r[i] = hit ? ambient_.x * diffuse.x : background_.x;
            always.g[i] = hit ? ambient_.y * diffuse.y : background_.y;
            always.b[i] = hit ? ambient_.z * diffuse.z : background_.z;

            const float reach = std::fabs(px) + std::fabs(py) + std::fabs(pz) + t * d_squared * to_viewer;
            const float lift = SHADOW_BIAS * reach;
            shadow.org_x[i] = px + nx * lift;
            shadow.org_y[i] = py + ny * lift;
            shadow.org_z[i] = pz + nz * lift;
            shadow.dir_x[i] = tx;
            shadow.dir_y[i] = ty;
            shadow.dir_z[i] = tz;
            shadow.tnear[i] = 0.0f;
            shadow.tfar[i] = 1.0f;
            shadow.mask[i] = ~0u;
            shadow.time[i] = 0.0f;
            shadow.flags[i] = 0;
        }
        if (count != 0) rtcOccluded16(lit, scene_.top, &shadow_context_, &shadow);
        for (int i = 0; i < LANES; ++i) {
            // Embree sets `tfar` of an occluded ray to minus infinity.
            const float seen = (lit[i] != 0) & (shadow.tfar[i] >= 0.0f) ? 1.0f : 0.0f;
            out.r[i] += always.r[i] + seen * from_light.r[i];
            out.g[i] += always.g[i] + seen * from_light.g[i];
            out.b[i] += always.b[i] + seen * from_light.b[i];
        }
        return count;
    }

    const EmbreeScene& scene_;
    RTCIntersectContext eye_context_, shadow_context_;
    Vec3f eye_, light_, radiance_, ambient_, background_;
};
