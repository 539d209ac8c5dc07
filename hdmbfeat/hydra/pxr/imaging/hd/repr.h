#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/imaging/interface.h"

#include <cstddef>
#include <memory>

HYDRA_INTERFACE_OPEN_SCOPE

class HdRepr;
using HdReprSharedPtr = std::shared_ptr<HdRepr>;

/// Names of the display representations asked for: refined surface, hull, points.
class HdReprSelector {
public:
    static constexpr size_t MAX_TOPOLOGY_REPRS = 3;

    HdReprSelector() = default;
    explicit HdReprSelector(const TfToken& refined) : refinedToken(refined) {}
    HdReprSelector(const TfToken& refined, const TfToken& unrefined)
        : refinedToken(refined),
          unrefinedToken(unrefined) {}
    HdReprSelector(const TfToken& refined, const TfToken& unrefined, const TfToken& points)
        : refinedToken(refined),
          unrefinedToken(unrefined),
          pointsToken(points) {}

    bool Contains(const TfToken& reprToken) const;
    bool IsActiveRepr(size_t topologyIndex) const;
    bool AnyActiveRepr() const;
    HdReprSelector CompositeOver(const HdReprSelector& under) const;
    bool operator==(const HdReprSelector& other) const;
    bool operator!=(const HdReprSelector& other) const;
    bool operator<(const HdReprSelector& other) const;
    size_t Hash() const;
    const char* GetText() const;
    const TfToken& operator[](size_t topologyIndex) const;

private:
    TfToken refinedToken;
    TfToken unrefinedToken;
    TfToken pointsToken;
};
HYDRA_INTERFACE_SIZE(HdReprSelector, 24, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
