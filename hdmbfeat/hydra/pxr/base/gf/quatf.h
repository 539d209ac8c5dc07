#pragma once
#include "pxr/gf/quatf.h" // IWYU pragma: export
