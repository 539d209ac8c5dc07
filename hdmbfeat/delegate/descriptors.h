// What the delegate says about itself: settings, AOVs, statistics, the translated scene.
#pragma once

#include "pxr/pxr.h"

#include "pxr/base/vt/dictionary.h"
#include "pxr/imaging/hd/aov.h"
#include "pxr/imaging/hd/command.h"
#include "pxr/imaging/hd/renderDelegate.h"

namespace mbfeat {
PXR_NAMESPACE_USING_DIRECTIVE

class RenderParam;

/// The table of settings, for menus of viewers. mbfeat:viewAov, whose values are the AOV names,
/// says them in its label, since descriptors carry no list of choices.
HdRenderSettingDescriptorList settingDescriptors();

/// Buffer format and clear value of an AOV; HdFormatInvalid for one that is not in the table.
HdAovDescriptor aovDescriptor(const TfToken& name);

/// Progress, times and counts under the names that hosts' panels look for.
VtDictionary renderStatistics(const RenderParam& param);

/// Writes the scene as it was last rendered, as text (scene/dump.h), to the file that the argument
/// `file` names; false, with a message, if it cannot. A running render starts anew.
bool writeSceneDump(RenderParam& param, const HdCommandArgs& args);

} // namespace mbfeat
