#pragma once
#include "pxr/tf/hashset.h" // IWYU pragma: export
