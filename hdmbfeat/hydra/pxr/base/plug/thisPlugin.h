#pragma once
#include "pxr/plug/thisPlugin.h" // IWYU pragma: export
