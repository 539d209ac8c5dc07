// The colour config that needs no file. Private to colorManagement.cpp.
#pragma once

#include <OpenColorIO/OpenColorIO.h>

namespace mbfeat {

namespace OCIO = OCIO_NAMESPACE;

/// See ColorConfig::builtIn(). Throws OCIO::Exception, which would be a defect.
OCIO::ConstConfigRcPtr makeBuiltInConfig();

} // namespace mbfeat
