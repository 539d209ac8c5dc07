#pragma once
#include "pxr/tf/staticTokens.h" // IWYU pragma: export
