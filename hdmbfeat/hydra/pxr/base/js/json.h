#pragma once
#include "pxr/js/json.h" // IWYU pragma: export
