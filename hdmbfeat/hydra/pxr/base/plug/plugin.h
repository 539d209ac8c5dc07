#pragma once
#include "pxr/plug/plugin.h" // IWYU pragma: export
