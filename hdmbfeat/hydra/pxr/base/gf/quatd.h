#pragma once
#include "pxr/gf/quatd.h" // IWYU pragma: export
