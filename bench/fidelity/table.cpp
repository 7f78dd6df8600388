#include "bench/fidelity/table.h"

namespace freevoxel::bench {

std::string Table::markdown() const {
  const auto line = [](const std::vector<std::string>& cells) {
    std::string text = "|";
    for (const std::string& cell : cells)
      text += " " + cell + " |";
    return text + "\n";
  };
  std::string text = line(head) + "|";
  for (size_t i = 0; i < head.size(); ++i)
    text += "---|";
  text += "\n";
  for (const std::vector<std::string>& row : rows)
    text += line(row);
  return text;
}

}  // namespace freevoxel::bench
