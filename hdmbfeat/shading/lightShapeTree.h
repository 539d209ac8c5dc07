// A hierarchy over the shapes of analytic lights for rays that may meet them, apart from that of
// the surfaces. A ray meets as many bounds of children at once as there are lanes, and in a leaf as
// many shapes of one kind: a hundred lights are a few steps, where calls for shape after shape cost
// more than the surfaces.
//
// Space: render space, float. A shape is met where its bounds and itself are, at the distance of
// intersectLight(), bit for bit; of shapes at the same distance the first in the list is met. Built
// by one thread; rays of any number of them.
#pragma once

#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "core/bounds.h"
#include "shading/lightImportance.h"
#include "shading/lightShapes.h"

namespace mbfeat {

struct PreparedLight;

class LightShapeTree {
public:
    LightShapeTree() = default;
    /// Of lights that are shapes; copied. Shapes are named by their index in the list. Where
    /// `shouldStop`, which may be empty, becomes true the tree is not whole.
    explicit LightShapeTree(const std::vector<const PreparedLight*>& shapes,
                            const std::function<bool()>& shouldStop = {});

    bool empty() const { return nodes_.empty(); }

    struct Ray {
        Float3 origin, direction; ///< of any length; distances are in units of it
        float tNear, tFar;
    };
    struct Hit {
        std::int32_t shape = -1; ///< -1: none
        float t = 0.0F;
    };
    /// The nearest shape in [tNear, tFar].
    Hit intersect(const Ray& ray) const;
    /// Whether there is any.
    bool occluded(const Ray& ray) const;

private:
    /// Eight where the machine has them, else four.
    using Lanes = ClusterBatch;
    static constexpr int kWidth = LaneTraits<Lanes>::kWidth;

    struct Boxes {
        Lanes lower[3], upper[3];
        std::uint32_t used; ///< which there are, as bits
    };
    struct Node {
        Boxes boxes;
        std::uint32_t child[kWidth]; ///< a node, or kLeaf + the leaf
    };
    /// Shapes of one kind; where there are fewer the first one again. Most rays that meet the box
    /// of all of them meet none of their own boxes, which is told without a division.
    struct Leaf {
        Boxes boxes;
        std::variant<RectShape<Lanes>, DiskShape<Lanes>, EllipsoidShape<Lanes>,
                     CylinderShape<Lanes>>
            shapes;
        std::int32_t names[kWidth];
    };
    static constexpr std::uint32_t kLeaf = 0x80000000U;
    /// What traversal wants of a ray.
    class Query;
    class BoxBuilder;
    class Builder;

    template <bool Any>
    Hit meet(const Ray& ray) const;

    std::vector<Node> nodes_; ///< the root first
    std::vector<Leaf> leaves_;
};

} // namespace mbfeat
