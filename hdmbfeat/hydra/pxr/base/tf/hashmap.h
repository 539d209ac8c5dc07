#pragma once
#include "pxr/tf/hashmap.h" // IWYU pragma: export
