#pragma once
#include "pxr/tf/token.h" // IWYU pragma: export
