// Random rays, one at a time: the incoherent rays of a general ray tracer.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "embree_scene.hpp"

// splitmix64 (Steele, Lea, Flood 2014). rayfarm's example `single_rays` makes the same rays.
class SplitMix64 {
  public:
    explicit SplitMix64(uint64_t seed) : state_(seed) {}

    // In [0, 1), 24 bits.
    float unit() { return float(next() >> 40) * 0x1p-24f; }

  private:
    uint64_t next() {
        uint64_t z = state_ += 0x9E3779B97F4A7C15;
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9;
        z = (z ^ z >> 27) * 0x94D049BB133111EB;
        return z ^ z >> 31;
    }

    uint64_t state_;
};

struct SingleRay {
    Vec3f origin, direction;
};

// Origins uniform in the box of the models, directions uniform on the sphere.
inline std::vector<SingleRay> random_rays(const EmbreeScene& scene, size_t count, uint64_t seed) {
    SplitMix64 random(seed);
    const Vec3f lower = to_float(scene.lower), extent = to_float(scene.upper) - lower;
    std::vector<SingleRay> rays(count);
    for (SingleRay& ray : rays) {
        ray.origin.x = lower.x + extent.x * random.unit();
        ray.origin.y = lower.y + extent.y * random.unit();
        ray.origin.z = lower.z + extent.z * random.unit();
        Vec3d v{};
        double squared = 0;
        do {
            v.x = 2.0 * random.unit() - 1.0, v.y = 2.0 * random.unit() - 1.0, v.z = 2.0 * random.unit() - 1.0;
            squared = dot(v, v);
        } while (!(squared > 0.0001 && squared <= 1.0));
        ray.direction = to_float(normalize(v));
    }
    return rays;
}

struct SingleRayReport {
    size_t hits = 0;
    double mean_t = 0, ns_per_ray = 0, ns_per_ray_any_hit = 0;
};

inline RTCRay ray_of(const SingleRay& from) {
    RTCRay ray{};
    ray.org_x = from.origin.x, ray.org_y = from.origin.y, ray.org_z = from.origin.z;
    ray.dir_x = from.direction.x, ray.dir_y = from.direction.y, ray.dir_z = from.direction.z;
    ray.tnear = 0.0f, ray.tfar = INFINITY, ray.mask = ~0u;
    return ray;
}

// The median of several passes over all rays; only traversal is timed.
inline SingleRayReport trace_single_rays(const EmbreeScene& scene, const std::vector<SingleRay>& rays, int passes) {
    using clock = std::chrono::steady_clock;
    SingleRayReport report;
    std::vector<double> closest, any;
    const double ns = 1e9 / double(rays.size());
    auto seconds = [](clock::time_point from) { return std::chrono::duration<double>(clock::now() - from).count(); };
    for (int pass = 0; pass < passes; ++pass) {
        size_t hits = 0, occluded = 0;
        double sum = 0;
        auto started = clock::now();
        for (const SingleRay& from : rays) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            RTCRayHit ray;
            ray.ray = ray_of(from);
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene.top, &context, &ray);
            if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) ++hits, sum += ray.ray.tfar;
        }
        closest.push_back(seconds(started) * ns);
        started = clock::now();
        for (const SingleRay& from : rays) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            RTCRay ray = ray_of(from);
            rtcOccluded1(scene.top, &context, &ray);
            occluded += ray.tfar < 0.0f;
        }
        any.push_back(seconds(started) * ns);
        report.hits = hits, report.mean_t = hits ? sum / double(hits) : 0.0;
        // Closest hit and any hit may disagree where a ray grazes an edge.
        if (occluded > hits + hits / 1000 || hits > occluded + hits / 1000)
            std::fprintf(stderr, "warning: %zu rays hit something, %zu are occluded\n", hits, occluded);
    }
    auto median = [](std::vector<double>& of) { return std::sort(of.begin(), of.end()), of[of.size() / 2]; };
    report.ns_per_ray = median(closest), report.ns_per_ray_any_hit = median(any);
    return report;
}
