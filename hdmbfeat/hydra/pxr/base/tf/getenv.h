#pragma once
#include "pxr/tf/getenv.h" // IWYU pragma: export
