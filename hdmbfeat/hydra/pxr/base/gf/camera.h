#pragma once
#include "pxr/gf/camera.h" // IWYU pragma: export
