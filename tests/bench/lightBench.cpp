// What the choice of a light costs: nanoseconds for choosing one and asking for the probability of
// one, as a path vertex does, by the number of lights; and the time to build the hierarchy. The
// choice by power alone, from a table, is what no look at the receiver costs.
//
// Lights are triangles spread in a cube, receivers points in and around it without any order, which
// is the worst for the caches. Processor time of the best of several runs is printed: other load on
// the machine only ever adds to it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "core/distribution.h"
#include "core/warp.h"
#include "shading/lightChoice.h"

using namespace mbfeat;

namespace {

constexpr int kReceivers = 1 << 14;
constexpr int kRuns = 7;

/// Random numbers: a step of SplitMix64 each.
class Random {
public:
    float next() {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t x = (state_ ^ (state_ >> 30U)) * 0xBF58476D1CE4E5B9ULL;
        x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
        return static_cast<float>(x >> 40U) * 0x1p-24F;
    }
    Float3 direction() {
        const float u = next(), v = next();
        return uniformSphere(Float2(u, v));
    }
    Float3 inCube() {
        const float x = next(), y = next(), z = next();
        return {x, y, z};
    }

private:
    std::uint64_t state_ = 1;
};

struct Query {
    LightReceiver receiver;
    float u = 0.0F;
    std::uint32_t entry = 0;
};

std::vector<LightBounds> lights(int count, Random& random) {
    std::vector<LightBounds> out;
    const float size = 0.3F / std::cbrt(static_cast<float>(count));
    for (int i = 0; i < count; ++i) {
        EmissiveTriangle t;
        t.p0 = random.inCube();
        t.p1 = t.p0 + random.direction() * size;
        t.p2 = t.p0 + random.direction() * size;
        t.radiance = Rgb(random.next() + 0.1F);
        out.push_back(boundsOf(t));
    }
    return out;
}

double secondsSince(std::clock_t start) {
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Nanoseconds per query of what `ask` does with it; its results are added to `sink`.
template <class Ask>
double measure(const std::vector<Query>& queries, double& sink, const Ask& ask) {
    double best = 1e30;
    for (int run = 0; run < kRuns; ++run) {
        const std::clock_t start = std::clock();
        for (int repeat = 0; repeat < 8; ++repeat) {
            for (const Query& q : queries) {
                sink += static_cast<double>(ask(q));
            }
        }
        best = std::min(best, secondsSince(start));
    }
    return 1e9 * best / (8.0 * static_cast<double>(queries.size()));
}

std::vector<Query> makeQueries(int lights, Random& random) {
    std::vector<Query> queries(kReceivers);
    for (Query& q : queries) {
        q.receiver = {random.inCube() * 1.5F - Float3(0.25F), random.direction(), false};
        q.u = random.next();
        q.entry = std::min(static_cast<std::uint32_t>(random.next() * static_cast<float>(lights)),
                           static_cast<std::uint32_t>(lights - 1));
    }
    return queries;
}

void printRow(int count, double& sink) {
    Random random;
    const std::vector<LightBounds> bounds = lights(count, random);
    const std::vector<Query> queries = makeQueries(count, random);
    std::vector<double> powers;
    powers.reserve(bounds.size());
    for (const LightBounds& b : bounds) {
        powers.push_back(b.strength);
    }
    const AliasTable table(powers);
    const std::clock_t start = std::clock();
    const LightChoice choice(bounds);
    const double build = secondsSince(start);
    const double byPower = measure(queries, sink, [&](const Query& q) {
        return table.sample(q.u).probability + table.probability(q.entry);
    });
    const double sample = measure(
        queries, sink, [&](const Query& q) { return choice.sample(q.receiver, q.u).probability; });
    const double probability = measure(
        queries, sink, [&](const Query& q) { return choice.probability(q.entry, q.receiver); });
    std::printf("%9d %10.1f %12.1f %12.1f %12.1f %7d %12.1f\n", count, byPower, sample, probability,
                sample + probability, choice.tree().depth(), 1e3 * build);
}

} // namespace

int main() {
    std::printf(
        "   lights   by power       sample  probability         both   depth     build ms\n");
    double sink = 0.0;
    for (const int count : {1, 2, 4, 8, 10, 30, 100, 1000, 10000, 100000, 1000000}) {
        printRow(count, sink);
    }
    std::printf("(sum of all answers %g)\n", sink);
    return 0;
}
