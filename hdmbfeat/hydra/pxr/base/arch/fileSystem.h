#pragma once
#include "pxr/arch/fileSystem.h" // IWYU pragma: export
