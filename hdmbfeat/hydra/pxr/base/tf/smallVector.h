#pragma once
#include "pxr/tf/smallVector.h" // IWYU pragma: export
