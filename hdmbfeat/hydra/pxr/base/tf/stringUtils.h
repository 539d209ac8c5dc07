#pragma once
#include "pxr/tf/stringUtils.h" // IWYU pragma: export
