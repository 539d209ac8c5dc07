#pragma once
#include "pxr/tf/registryManager.h" // IWYU pragma: export
