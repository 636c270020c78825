#include "experiments/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace halfgrad {

namespace {

// Colours that people with any colour vision tell apart (Okabe and Ito 2008), black last; markers differ as well.
constexpr std::array colours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"};
constexpr int num_markers = 4;

constexpr double width = 460, height = 330, left = 74, right = 12, top = 30, bottom = 44;

std::string marker(double x, double y, int style, const std::string& note) {
  const char* colour = colours[static_cast<std::size_t>(style) % colours.size()];
  const std::string title = note.empty() ? "" : fmt::format("<title>{}</title>", escaped(note));
  constexpr double r = 4;
  switch (style % num_markers) {
    case 0:
      return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'>{}</circle>", x, y, r, colour, title);
    case 1:
      return fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{}' height='{}' fill='{}'>{}</rect>", x - r, y - r, 2 * r,
                         2 * r, colour, title);
    case 2:
      return fmt::format("<path d='M{:.1f} {:.1f} l{} {} h{} z' fill='{}'>{}</path>", x, y - r - 1, r + 1, 2 * r + 1,
                         -2 * (r + 1), colour, title);
    default:
      return fmt::format("<path d='M{:.1f} {:.1f} l{} {} l{} {} l{} {} z' fill='{}'>{}</path>", x, y - r - 1, r + 1,
                         r + 1, -(r + 1), r + 1, -(r + 1), -(r + 1), colour, title);
  }
}

// One axis: from values to pixels, with ticks.
class Axis {
 public:
  Axis(bool logarithmic, double pixel_low, double pixel_high)
      : logarithmic_(logarithmic), pixel_low_(pixel_low), pixel_high_(pixel_high) {}

  bool shows(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }
  void include(double value) {
    low_ = std::min(low_, scaled(value));
    high_ = std::max(high_, scaled(value));
  }
  void finish() {
    if (!(low_ <= high_)) low_ = 0, high_ = 1;
    const double margin = high_ > low_ ? 0.06 * (high_ - low_) : 0.5;
    low_ -= margin;
    high_ += margin;
  }
  double pixel(double value) const {
    return pixel_low_ + (pixel_high_ - pixel_low_) * (scaled(value) - low_) / (high_ - low_);
  }
  double low() const { return logarithmic_ ? std::pow(10, low_) : low_; }
  double high() const { return logarithmic_ ? std::pow(10, high_) : high_; }

  std::vector<double> ticks() const {
    std::vector<double> ticks;
    if (logarithmic_) {
      // Powers of ten; multiples of them where there are few.
      const double decades = high_ - low_;
      const std::vector<double> factors = decades < 0.7 ? std::vector<double>{1, 1.5, 2, 3, 4, 5, 6, 8}
                                          : decades < 2 ? std::vector<double>{1, 2, 5}
                                                        : std::vector<double>{1};
      const int step = std::max(1, static_cast<int>(decades / 7));
      for (int e = static_cast<int>(std::floor(low_)); e <= static_cast<int>(std::ceil(high_)); e += step)
        for (const double factor : factors)
          if (const double tick = factor * std::pow(10, e); inside(tick)) ticks.push_back(tick);
      return ticks;
    }
    const double raw = (high_ - low_) / 5, power = std::pow(10, std::floor(std::log10(raw)));
    const double step = raw / power < 1.5   ? power
                        : raw / power < 3.5 ? 2 * power
                        : raw / power < 7.5 ? 5 * power
                                            : 10 * power;
    for (double tick = std::ceil(low_ / step) * step; tick <= high_; tick += step)
      ticks.push_back(std::abs(tick) < 1e-9 * step ? 0 : tick);
    return ticks;
  }

 private:
  double scaled(double value) const { return logarithmic_ ? std::log10(value) : value; }
  bool inside(double value) const { return scaled(value) >= low_ && scaled(value) <= high_; }

  bool logarithmic_;
  double pixel_low_, pixel_high_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  return result;
}

std::string svg_marker(int style) {
  return fmt::format("<svg width='14' height='14' aria-hidden='true'>{}</svg>", marker(7, 7, style, ""));
}

std::string svg_chart(const Chart& chart) {
  Axis x(chart.log_x, left, width - right), y(chart.log_y, height - bottom, top);
  const auto shown = [&](const ChartSeries& series, std::size_t i) {
    return x.shows(series.x[i]) && y.shows(series.y[i]);
  };
  for (const ChartSeries& series : chart.series)
    for (std::size_t i = 0; i < series.x.size(); ++i)
      if (shown(series, i)) {
        x.include(series.x[i]);
        y.include(series.y[i]);
      }
  x.finish();
  y.finish();

  std::string svg =
      fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='{}'>", width, height, escaped(chart.title));
  svg += fmt::format("<text x='{}' y='18' class='title'>{}</text>", left, escaped(chart.title));
  for (const double tick : x.ticks())
    svg += fmt::format(
        "<path class='grid' d='M{0:.1f} {1} V{2}'/><text x='{0:.1f}' y='{3}' text-anchor='middle'>{4:g}</text>",
        x.pixel(tick), top, height - bottom, height - bottom + 16, tick);
  for (const double tick : y.ticks())
    svg += fmt::format(
        "<path class='grid' d='M{0} {1:.1f} H{2}'/><text x='{3}' y='{4:.1f}' text-anchor='end'>{5:g}</text>", left,
        y.pixel(tick), width - right, left - 6, y.pixel(tick) + 4, tick);
  svg += fmt::format("<rect class='frame' x='{}' y='{}' width='{}' height='{}'/>", left, top, width - left - right,
                     height - top - bottom);
  svg += fmt::format("<text x='{}' y='{}' text-anchor='middle'>{}</text>", (left + width - right) / 2, height - 8,
                     escaped(chart.x_label));
  svg += fmt::format("<text transform='translate(12 {}) rotate(-90)' text-anchor='middle'>{}</text>",
                     (top + height - bottom) / 2, escaped(chart.y_label));

  // Guides start at the lower right, where errors of fine meshes rarely are.
  for (const double slope : chart.guide_slopes) {
    const double x1 = x.high(), y0 = y.low();
    const double reach = std::min(std::log10(x1 / x.low()) * 0.45, std::log10(y.high() / y0) * 0.9 / slope);
    const double x0 = x1 * std::pow(10, -reach), y1 = y0 * std::pow(10, slope * reach);
    svg += fmt::format(
        "<path class='guide' d='M{:.1f} {:.1f} L{:.1f} {:.1f}'/><text class='guide' x='{:.1f}' y='{:.1f}'>{:g}</text>",
        x.pixel(x0), y.pixel(y0), x.pixel(x1), y.pixel(y1), x.pixel(x1) - 14, y.pixel(y1) + 12, slope);
  }
  for (const ChartSeries& series : chart.series) {
    const char* colour = colours[static_cast<std::size_t>(series.style) % colours.size()];
    std::string path, markers;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!shown(series, i)) continue;
      const double px = x.pixel(series.x[i]), py = y.pixel(series.y[i]);
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", px, py);
      const std::string note = i < series.notes.size() ? series.notes[i] : series.name;
      if (series.has_markers) markers += marker(px, py, series.style, note);
    }
    if (series.connected && !path.empty())
      svg += fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='1.6'{}/>", path, colour,
                         series.style >= static_cast<int>(colours.size()) ? " stroke-dasharray='5 3'" : "");
    svg += markers;
  }
  return svg + "</svg>";
}

}  // namespace halfgrad
