#pragma once
#include "pxr/tf/refBase.h" // IWYU pragma: export
