// The secondary rays of a scene, from a file of rayfarm's example `bounced_rays`: six floats a ray, origin and unit direction.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "embree_scene.hpp"
#include "single_rays.hpp"

inline std::vector<SingleRay> read_rays(const std::string& path) {
    static_assert(sizeof(SingleRay) == 6 * sizeof(float), "six floats a ray");
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) throw std::runtime_error(path + ": cannot be read");
    std::vector<SingleRay> rays;
    SingleRay ray;
    while (std::fread(&ray, sizeof ray, 1, file) == 1) rays.push_back(ray);
    std::fclose(file);
    if (rays.empty()) throw std::runtime_error(path + ": no rays");
    return rays;
}

inline float closest_distance(const EmbreeScene& scene, const SingleRay& from) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit ray;
    ray.ray = ray_of(from);
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene.top, &context, &ray);
    return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1.0f : ray.ray.tfar;
}

inline bool any_hit(const EmbreeScene& scene, const SingleRay& from) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray = ray_of(from);
    rtcOccluded1(scene.top, &context, &ray);
    return ray.tfar < 0.0f;
}

// `"name":{"min_ns":..,"median_ns":..}`: nanoseconds per ray, as rayfarm's example measures them. The median is that of passes over
// all rays; the least time takes for each 1,024 rays the pass that was fastest there.
template <class Trace>
std::string times(const char* name, const std::vector<SingleRay>& rays, Trace trace) {
    using clock = std::chrono::steady_clock;
    constexpr size_t passes = 9, timed = 1024;
    std::vector<double> least((rays.size() + timed - 1) / timed, 1e300), totals(passes);
    volatile size_t sink = 0;
    for (double& total : totals) {
        for (size_t part = 0; part < least.size(); ++part) {
            const size_t end = std::min(rays.size(), (part + 1) * timed);
            size_t hits = 0;
            const auto started = clock::now();
            for (size_t i = part * timed; i < end; ++i) hits += trace(rays[i]);
            const double seconds = std::chrono::duration<double>(clock::now() - started).count();
            sink = hits;
            least[part] = std::min(least[part], seconds);
            total += seconds;
        }
    }
    (void)sink;
    std::sort(totals.begin(), totals.end());
    double sum = 0;
    for (double seconds : least) sum += seconds;
    const double ns = 1e9 / double(rays.size());
    char text[160];
    std::snprintf(text, sizeof text, "\"%s\":{\"min_ns\":%.2f,\"median_ns\":%.2f}", name, sum * ns, totals[passes / 2] * ns);
    return text;
}

// Prints one line of JSON, and writes the distance of each hit as a float, -1 without a hit.
inline void time_bounced_rays(const EmbreeScene& scene, const std::string& path, const std::string& hit_file) {
    const std::vector<SingleRay> rays = read_rays(path);
    std::vector<float> distances;
    for (const SingleRay& ray : rays) distances.push_back(closest_distance(scene, ray));
    const auto hit = [](float distance) { return distance >= 0.0f; };
    const size_t hits = size_t(std::count_if(distances.begin(), distances.end(), hit));
    if (!hit_file.empty()) {
        std::FILE* file = std::fopen(hit_file.c_str(), "wb");
        if (!file) throw std::runtime_error(hit_file + ": cannot be written");
        const bool whole = std::fwrite(distances.data(), sizeof(float), distances.size(), file) == distances.size();
        if (std::fclose(file) != 0 || !whole) throw std::runtime_error(hit_file + ": not written to its end");
    }
    const std::string closest = times("closest", rays, [&](auto& ray) { return closest_distance(scene, ray) >= 0.0f; });
    const std::string any = times("any", rays, [&](auto& ray) { return any_hit(scene, ray); });
    std::printf("{\"rays\":%zu,\"hits\":%zu,%s,%s}\n", rays.size(), hits, closest.c_str(), any.c_str());
}
