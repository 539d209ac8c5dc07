#pragma once
#include "pxr/tf/enum.h" // IWYU pragma: export
