#pragma once
#include "pxr/tf/staticData.h" // IWYU pragma: export
