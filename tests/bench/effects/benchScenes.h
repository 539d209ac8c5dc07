// Small scenes that get each of the prebuilt kernels.
#pragma once

#include <string>

#include "integrate/testScenes.h"

namespace mbfeat::test {

/// By the name of a prebuilt kernel; "everything" calls for all effects that there are.
void fillBenchScene(TestScene& test, const std::string& name);
Camera benchCamera(const std::string& name);

} // namespace mbfeat::test
