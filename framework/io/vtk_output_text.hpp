// The contents of XML VTK files, for writers of one file and of sequences.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "framework/io/frame_sink.hpp"

namespace halfgrad {

/// A .vtp file; floats stay floats. `name` is for messages. Throws Error where rows or names of arrays do not fit.
std::string vtp_text(const std::string& name, const Values<double>& points, const IndexTable& faces,
                     std::span<const PointArray> arrays);
std::string vtp_text(const std::string& name, const Values<float>& points, const IndexTable& faces,
                     std::span<const PointArray> arrays);

/// A text as the value of an XML attribute.
std::string xml_escaped(std::string_view text);

}  // namespace halfgrad
