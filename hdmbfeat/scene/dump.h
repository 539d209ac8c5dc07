// A committed scene as text, so that translation can be tested exactly and without rendering.
#pragma once

#include <string>

#include "scene/scene.h"

namespace mbfeat {

/// The committed geometries, materials and lights in their order, one fact a line, indented below
/// the prim it belongs to. Numbers are the shortest text that reads back as the same value; arrays
/// are given by count and a checksum (FNV-1a, 64 bits, of their bytes). Two scenes with the same
/// text render the same image. The lines are meant for people too, but are not a file format.
std::string dumpScene(const Scene& scene);

} // namespace mbfeat
