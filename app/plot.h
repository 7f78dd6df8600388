// Curves drawn by gnuplot.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace freevoxel {

struct Curve {
  std::string name;
  std::vector<std::pair<double, double>> points;
  bool dashed = false;
};

/// One panel; x is logarithmic to base 2.
struct PlotPanel {
  std::string title, yLabel;
  bool logarithmicY = false;
  std::vector<Curve> curves;
};

/// Draws panels side by side into a .png or .svg file, which appears whole or not at all. Throws MachineError if
/// gnuplot is missing or fails.
void plot(const std::string& path, const std::string& xLabel, const std::vector<PlotPanel>& panels);

}  // namespace freevoxel
