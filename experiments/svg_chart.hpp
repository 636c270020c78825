// Line and scatter charts as SVG text: no script, no library, legible on paper.
#pragma once

#include <string>
#include <vector>

namespace halfgrad {

/// One line of a chart. Points that a logarithmic axis cannot show are left out.
struct ChartSeries {
  std::string name;
  std::vector<double> x, y;
  std::vector<std::string> notes;  ///< a text a point, shown on hovering; may be empty
  int style = 0;                   ///< colour and marker; equal styles look equal in all charts
  bool connected = true;           ///< a line through the points
  bool has_markers = true;         ///< a marker at each point
};

struct Chart {
  std::string title, x_label, y_label;
  bool log_x = true, log_y = true;
  std::vector<ChartSeries> series;
  std::vector<double> guide_slopes;  ///< dashed lines y ∝ x^slope on two logarithmic axes, through the lower right
};

/// An <svg> element.
std::string svg_chart(const Chart& chart);

/// The marker and colour of a style as a small <svg> element, for legends and tables.
std::string svg_marker(int style);

/// Text with the characters escaped that HTML and SVG give a meaning.
std::string escaped(const std::string& text);

}  // namespace halfgrad
