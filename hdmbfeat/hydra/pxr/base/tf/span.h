#pragma once
#include "pxr/tf/span.h" // IWYU pragma: export
