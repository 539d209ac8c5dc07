#pragma once
#include "pxr/tf/singleton.h" // IWYU pragma: export
