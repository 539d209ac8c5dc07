#pragma once
#include "pxr/plug/registry.h" // IWYU pragma: export
