#pragma once
#include "pxr/tf/status.h" // IWYU pragma: export
