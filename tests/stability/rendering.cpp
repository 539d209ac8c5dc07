#include "rendering.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <thread>

#include "trapHandler.h"

namespace mbfeat::stability {

namespace {

constexpr int kThreads = 2;

/// The samples of pixels first, first + kThreads, ... of the image.
void traceShare(const Integrator& integrator, int first, int samples, Estimate& estimate) {
    const std::unique_ptr<PathWorker> worker = integrator.makeWorker();
    std::vector<PixelSample> batch;
    const auto count = static_cast<std::size_t>(worker->capacity());
    const auto flush = [&] {
        if (batch.empty()) {
            return;
        }
        integrator.trace(*worker, batch.data(), static_cast<int>(batch.size()), {});
        for (std::size_t i = 0; i < batch.size(); ++i) {
            const PathRecord& record = worker->records()[i];
            PixelMeans& pixel = estimate.pixels[static_cast<std::size_t>(batch[i].y) *
                                                    static_cast<std::size_t>(estimate.width) +
                                                static_cast<std::size_t>(batch[i].x)];
            pixel.color += Double3(record.radiance);
            pixel.alpha += record.alpha;
            pixel.distance += record.distance;
            pixel.vertices += record.vertexCount;
            pixel.mostVertices = std::max(pixel.mostVertices, static_cast<int>(record.vertexCount));
        }
        batch.clear();
    };
    for (int p = first; p < estimate.width * estimate.height; p += kThreads) {
        for (int s = 0; s < samples; ++s) {
            batch.push_back(
                {p % estimate.width, p / estimate.width, static_cast<std::uint32_t>(s)});
            if (batch.size() == count) {
                flush();
            }
        }
    }
    flush();
    for (int p = first; p < estimate.width * estimate.height; p += kThreads) {
        PixelMeans& pixel = estimate.pixels[static_cast<std::size_t>(p)];
        const double scale = 1.0 / samples;
        pixel.color *= scale;
        pixel.alpha *= scale;
        pixel.distance *= scale;
        pixel.vertices *= scale;
    }
}

} // namespace

std::vector<double> Estimate::grey() const {
    std::vector<double> values;
    for (const PixelMeans& p : pixels) {
        values.push_back((p.color.x + p.color.y + p.color.z) / 3.0);
    }
    return values;
}

double Estimate::mean() const {
    double sum = 0.0;
    for (const double v : grey()) {
        sum += v;
    }
    return sum / static_cast<double>(pixels.size());
}

double Estimate::shareAbove(int vertices) const {
    const auto above = std::count_if(pixels.begin(), pixels.end(), [&](const PixelMeans& p) {
        return p.mostVertices > vertices;
    });
    return static_cast<double>(above) / static_cast<double>(pixels.size());
}

Picture Estimate::picture(const std::string& name) const {
    Picture result{name, width, height, {}};
    for (const PixelMeans& p : pixels) {
        for (int c = 0; c < 3; ++c) {
            result.rgb.push_back(static_cast<float>(p.color[c]));
        }
    }
    return result;
}

RenderOptions plainOptions(int samplesPerPixel, int maxBounces) {
    RenderOptions options = test::exactOptions(samplesPerPixel);
    options.maxBounces = maxBounces;
    options.russianRouletteStart = maxBounces;
    return options;
}

Estimate trace(test::TestScene& test, const Camera& camera, int width, int height,
               const RenderOptions& wanted) {
    if (wanted.clampDirect != 0.0F || wanted.clampIndirect != 0.0F) {
        throw std::logic_error("a clamp is on");
    }
    IntegratorRequest request;
    request.options = wanted;
    request.options.kernel = trapsAreOn() ? Kernel::kScalar : wanted.kernel;
    request.recordFlags = kRecordFeatures | kRecordFirstHit;
    ImageWindow window;
    window.width = width;
    window.height = height;
    window.data = {0, 0, width, height};

    Integrator integrator(test.scene);
    integrator.commit(request.options, {});
    if (const Status bad = integrator.setView(camera, window, request)) {
        throw std::runtime_error(bad->subject + " " + bad->text);
    }
    Estimate estimate;
    estimate.width = width;
    estimate.height = height;
    estimate.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    const bool traps = trapsAreOn();
    std::vector<std::thread> threads;
    threads.reserve(kThreads);
    for (int i = 0; i < kThreads; ++i) {
        threads.emplace_back([&, i] {
            switchTraps(traps);
            traceShare(integrator, i, wanted.samplesPerPixel, estimate);
        });
    }
    for (std::thread& thread : threads) {
        thread.join();
    }
    const TraceStatistics statistics = integrator.statistics();
    estimate.paths = statistics.paths;
    estimate.rays = statistics.rays;
    if (statistics.nonFinite > 0) {
        throw std::runtime_error(std::to_string(statistics.nonFinite) + " samples of " +
                                 std::to_string(statistics.paths) + " are not finite");
    }
    return estimate;
}

double score(const Estimate& estimate, double truth) {
    return std::abs(standardScore(estimate.grey(), truth));
}

double score(const Estimate& a, const Estimate& b) {
    std::vector<double> difference = a.grey();
    const std::vector<double> other = b.grey();
    double scale = 0.0;
    for (std::size_t i = 0; i < difference.size(); ++i) {
        difference[i] -= other[i];
        scale += std::abs(other[i]) / static_cast<double>(other.size());
    }
    // Relative to the image, so that rounding is judged by its brightness.
    for (double& d : difference) {
        d = scale > 0.0 ? d / scale + 1.0 : d;
    }
    return std::abs(standardScore(difference, scale > 0.0 ? 1.0 : 0.0));
}

Camera cameraOfScale(const Double3& position, float tangent, double scale) {
    Camera camera = test::testCamera(position, tangent);
    camera.nearClip = static_cast<float>(1e-3 * scale);
    camera.farClip = static_cast<float>(1e6 * scale);
    return camera;
}

AffineD skew(double scale) {
    // Rodrigues' rotation by 1 radian about (1, 2, 3).
    const Double3 axis = normalize(Double3(1.0, 2.0, 3.0));
    const double c = std::cos(1.0), s = std::sin(1.0);
    const auto turned = [&](const Double3& v) {
        return (v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1.0 - c))) * scale;
    };
    AffineD m;
    m.x = turned({1.0, 0.0, 0.0});
    m.y = turned({0.0, 1.0, 0.0});
    m.z = turned({0.0, 0.0, 1.0});
    return m;
}

std::shared_ptr<Mesh> facetedSphere(float radius, int segments, bool inward) {
    std::shared_ptr<Mesh> mesh = test::sphereMesh(radius, segments, inward);
    mesh->normals = Attribute();
    return mesh;
}

} // namespace mbfeat::stability
