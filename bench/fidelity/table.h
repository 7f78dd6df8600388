// A table in Markdown.
#pragma once

#include <string>
#include <vector>

namespace freevoxel::bench {

struct Table {
  std::vector<std::string> head;  ///< the first entry stands over the rows' names
  std::vector<std::vector<std::string>> rows;

  std::string markdown() const;
};

}  // namespace freevoxel::bench
