#pragma once
#include "pxr/tf/hash.h" // IWYU pragma: export
