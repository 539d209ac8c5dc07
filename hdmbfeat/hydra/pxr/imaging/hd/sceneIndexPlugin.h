#pragma once

#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/hf/pluginBase.h"
#include "pxr/imaging/interface.h"

#include <string>

HYDRA_INTERFACE_OPEN_SCOPE

/// Inserts scene indices of its own between the scene and a renderer.
class HdSceneIndexPlugin : public HfPluginBase {
public:
    HdSceneIndexBaseRefPtr AppendSceneIndex(const std::string& renderInstanceId,
                                            const HdSceneIndexBaseRefPtr& inputScene,
                                            const HdContainerDataSourceHandle& inputArgs);

protected:
    HdSceneIndexPlugin() = default;
    ~HdSceneIndexPlugin() override;

    /// Override the first; the library's second calls it.
    virtual HdSceneIndexBaseRefPtr _AppendSceneIndex(const HdSceneIndexBaseRefPtr& inputScene,
                                                     const HdContainerDataSourceHandle& inputArgs);
    virtual HdSceneIndexBaseRefPtr _AppendSceneIndex(const std::string& renderInstanceId,
                                                     const HdSceneIndexBaseRefPtr& inputScene,
                                                     const HdContainerDataSourceHandle& inputArgs);
};
HYDRA_INTERFACE_SIZE(HdSceneIndexPlugin, 8, 8);

HYDRA_INTERFACE_CLOSE_SCOPE
