// XYZ and PDB.
#include <algorithm>
#include <glm/mat3x3.hpp>
#include <set>

#include "base/error.h"
#include "base/grid.h"
#include "volume/text_parsing.h"
#include "volume/whole_file.h"
#include "voxlink/elements.h"
#include "voxlink/raw_spheres.h"

namespace freevoxel {

namespace {

constexpr size_t kLargestFile = size_t(1) << 36;
constexpr uint64_t kMostSpheres = 0xfffffffeu;

/// Adds atoms one by one.
class AtomList {
 public:
  explicit AtomList(RawSpheres& file) : file_(file) {}

  void add(glm::dvec3 place, std::string_view symbol) {
    const Element& element = elementNamed(symbol);
    if (!isElement(symbol)) ++unknown_;
    file_.spheres.centres.emplace_back(place);
    file_.spheres.radii.push_back(element.radius);
    file_.spheres.materialOfSphere.push_back(
        names_.number(std::string(element.symbol), file_.spheres, [&] { return materialOf(element); }));
    ++file_.report.fileSpheres;
  }
  void finish() {
    if (unknown_ > 0)
      file_.report.notes.push_back(fmt::format("{} atoms of unknown elements: radius 2, pink", unknown_));
  }

 private:
  RawSpheres& file_;
  MaterialNames names_;
  uint64_t unknown_ = 0;
};

/// REMARK 350: what to do with the atoms of some chains to get the whole.
struct Assembly {
  struct Copy {
    glm::dmat3 linear{0.0};  ///< by rows: dot products with the columns of the transpose
    glm::dvec3 shift{0.0};
    int rows = 0;
  };
  struct Group {
    std::set<char> chains;  ///< empty: all
    std::vector<Copy> copies;
  };
  std::vector<Group> groups;
  int biomolecule = 0;
  bool severalDescribed = false;
};

void parseChains(std::string_view text, std::set<char>& chains) {
  for (const char c : text) {
    if (c != ',' && c != ' ') chains.insert(c);
  }
}

/// A line "REMARK 350 ...", without these words.
void parseAssembly(const TextLines& lines, std::string_view text, Assembly& assembly) {
  const std::vector<std::string_view> parts = words(text);
  if (parts.empty()) return;
  if (parts[0] == "BIOMOLECULE:") {
    ++assembly.biomolecule;
    if (assembly.biomolecule > 1) assembly.severalDescribed = true;
    return;
  }
  if (assembly.biomolecule > 1) return;  // the first is enough
  constexpr std::string_view kApply = "APPLY THE FOLLOWING TO CHAINS:", kAnd = "AND CHAINS:";
  const std::string_view line = trimmed(text);
  if (line.starts_with(kApply)) {
    assembly.groups.emplace_back();
    parseChains(line.substr(kApply.size()), assembly.groups.back().chains);
    return;
  }
  if (line.starts_with(kAnd) && !assembly.groups.empty()) {
    parseChains(line.substr(kAnd.size()), assembly.groups.back().chains);
    return;
  }
  if (!parts[0].starts_with("BIOMT")) return;
  if (parts.size() != 6 || parts[0].size() != 6 || parts[0][5] < '1' || parts[0][5] > '3') {
    lines.fail("expected BIOMT1 to BIOMT3, a number, and four numbers of a row, found " + inQuotes(line));
  }
  const int row = parts[0][5] - '1';
  if (assembly.groups.empty()) assembly.groups.emplace_back();
  std::vector<Assembly::Copy>& copies = assembly.groups.back().copies;
  if (row == 0) copies.emplace_back();
  if (copies.empty() || copies.back().rows != row) {
    lines.fail(fmt::format("expected the rows BIOMT1, BIOMT2, BIOMT3 in order, found {}", parts[0]));
  }
  for (int column = 0; column < 3; ++column)
    copies.back().linear[column][row] = lines.number(parts[size_t(2 + column)], "a row's entry");
  copies.back().shift[row] = lines.number(parts[5], "a row's shift");
  ++copies.back().rows;
}

/// The element of an atom: as its own columns say, or else as its name begins.
std::string_view symbolOf(std::string_view record) {
  if (record.size() >= 77) {
    const std::string_view symbol = trimmed(record.substr(76, 2));
    if (isElement(symbol)) return symbol;
  }
  const std::string_view name = record.substr(12, 4);
  const auto isLetter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); };
  // A symbol of one letter begins in the second column.
  if (isLetter(name[0]) && isElement(name.substr(0, 2)) && isLetter(name[1])) return name.substr(0, 2);
  for (size_t i = 0; i < name.size(); ++i) {
    if (isLetter(name[i])) return name.substr(i, 1);
  }
  return {};
}

/// Repeats the atoms as the assembly says. Chains that it does not name are left out.
void repeat(RawSpheres& file, const std::vector<char>& chains, const Assembly& assembly, const std::string& path) {
  const Spheres part = std::move(file.spheres);
  Spheres& whole = file.spheres;
  whole = {};
  whole.materials = part.materials;
  uint64_t total = 0;
  for (const Assembly::Group& group : assembly.groups) {
    uint64_t members = 0;
    for (const char chain : chains)
      members += group.chains.empty() || group.chains.count(chain) > 0;
    const std::optional<uint64_t> added = checkedProduct(members, group.copies.size());
    if (!added || *added > kMostSpheres || (total += *added) > kMostSpheres) {
      throw InputError(fmt::format("{}: expected at most 2^32 - 2 atoms with all copies, found more", path));
    }
    file.report.copies = std::max(file.report.copies, uint64_t(group.copies.size()));
  }
  uint64_t used = 0;
  for (size_t i = 0; i < chains.size(); ++i) {
    used += std::any_of(assembly.groups.begin(), assembly.groups.end(), [&](const Assembly::Group& group) {
      return group.chains.empty() || group.chains.count(chains[i]) > 0;
    });
  }
  if (used < chains.size()) {
    file.report.notes.push_back(
        fmt::format("{} atoms of chains that the assembly does not name are left out", chains.size() - used));
  }
  for (const Assembly::Group& group : assembly.groups) {
    for (const Assembly::Copy& copy : group.copies) {
      for (size_t i = 0; i < chains.size(); ++i) {
        if (!group.chains.empty() && group.chains.count(chains[i]) == 0) continue;
        whole.centres.emplace_back(copy.linear * glm::dvec3(part.centres[i]) + copy.shift);
        whole.radii.push_back(part.radii[i]);
        whole.materialOfSphere.push_back(part.materialOfSphere[i]);
      }
    }
  }
}

}  // namespace

RawSpheres readXyz(const std::string& path, const SphereOptions&) {
  const std::vector<std::byte> bytes = readWholeFile(path, kLargestFile);
  TextLines lines(asText(bytes), path);
  RawSpheres file;
  file.report.format = "XYZ";
  AtomList atoms(file);
  if (!lines.next()) lines.fail("expected the number of atoms, found the end of the file");
  const std::optional<uint64_t> count = parseNumber<uint64_t>(trimmed(lines.line()));
  if (!count || *count < 1 || *count > kMostSpheres) {
    lines.fail("expected the number of atoms, found " + inQuotes(trimmed(lines.line())));
  }
  if (!lines.next()) lines.fail("expected a line of remarks, found the end of the file");
  for (uint64_t i = 0; i < *count; ++i) {
    if (!lines.next()) lines.fail(fmt::format("expected {} atoms, found the end of the file after {}", *count, i));
    const std::vector<std::string_view> parts = words(lines.line());
    if (parts.size() < 4)
      lines.fail(fmt::format("expected an element and three numbers, found {} words", parts.size()));
    if (!lines.ended() && parts.size() > 4) lines.fail("expected an end of the line, found the end of the file");
    glm::dvec3 place;
    for (int axis = 0; axis < 3; ++axis)
      place[axis] = lines.number(parts[size_t(1 + axis)], "a place");
    atoms.add(place, parts[0]);
  }
  atoms.finish();
  if (!trimmed(lines.rest()).empty()) file.report.notes.push_back("only the first of several frames");
  return file;
}

RawSpheres readPdb(const std::string& path, const SphereOptions& options) {
  const std::vector<std::byte> bytes = readWholeFile(path, kLargestFile);
  TextLines lines(asText(bytes), path);
  RawSpheres file;
  file.report.format = "PDB";
  AtomList atoms(file);
  Assembly assembly;
  std::vector<char> chains;
  bool ended = false, skipping = false, severalModels = false;
  while (lines.next()) {
    const std::string_view line = lines.line();
    const std::string_view record = trimmed(line.substr(0, 6));
    if (record == "END") {
      ended = true;
    } else if (record == "ENDMDL") {
      skipping = true;
    } else if (record == "MODEL") {
      severalModels = severalModels || skipping;
    } else if (line.starts_with("REMARK 350")) {
      parseAssembly(lines, line.substr(10), assembly);
    } else if ((record == "ATOM" || record == "HETATM") && !skipping) {
      if (line.size() < 54 || !lines.ended()) {
        lines.fail(fmt::format("expected an atom of at least 54 columns and an end of the line, found {}{}",
                               line.size(), lines.ended() ? "" : " and the end of the file"));
      }
      glm::dvec3 place;
      for (int axis = 0; axis < 3; ++axis) {
        const size_t column = 30 + 8 * size_t(axis);
        place[axis] =
            lines.number(line.substr(column, 8), fmt::format("a place in columns {} to {}", column + 1, column + 8));
      }
      atoms.add(place, symbolOf(line));
      chains.push_back(line[21]);
    }
  }
  atoms.finish();
  if (chains.empty()) throw InputError(fmt::format("{}: expected ATOM or HETATM records, found none", path));
  if (!ended) file.report.notes.push_back("no END record: the file may be cut off");
  if (severalModels) file.report.notes.push_back("only the first of several models");
  for (const Assembly::Group& group : assembly.groups) {
    if (group.copies.empty() || group.copies.back().rows != 3) {
      throw InputError(
          fmt::format("{}: expected rows BIOMT1 to BIOMT3 of every copy in REMARK 350, found fewer", path));
    }
  }
  if (assembly.severalDescribed) file.report.notes.push_back("only the first of several assemblies");
  if (options.copies && !assembly.groups.empty()) repeat(file, chains, assembly, path);
  return file;
}

}  // namespace freevoxel
