#pragma once

#include "pxr/base/tf/token.h"
#include "pxr/base/vt/dictionary.h"
#include "pxr/imaging/cameraUtil/conformWindow.h"
#include "pxr/imaging/hd/dataSource.h"
#include "pxr/imaging/hd/sceneIndex.h"
#include "pxr/imaging/interface.h"
#include "pxr/usd/sdf/path.h"

HYDRA_INTERFACE_OPEN_SCOPE

namespace HdUtils {

/// Whether the scene names an active render settings prim, and which.
bool HasActiveRenderSettingsPrim(const HdSceneIndexBaseRefPtr& sceneIndex,
                                 SdfPath* primPath = nullptr);

/// The frame that the host renders, where it told one: false when not.
bool GetCurrentFrame(const HdSceneIndexBaseRefPtr& sceneIndex, double* frame);

/// Tokens, arrays of tokens and nested dictionaries become data sources of those types.
HdContainerDataSourceHandle ConvertVtDictionaryToContainerDS(const VtDictionary& dictionary);

/// From the text of an aspectRatioConformPolicy attribute.
CameraUtilConformWindowPolicy ToConformWindowPolicy(const TfToken& token);

} // namespace HdUtils

HYDRA_INTERFACE_CLOSE_SCOPE
