// Spheres from tiny files written here.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "voxlink/read_spheres.h"

namespace freevoxel::test::read_spheres_tests {

namespace {

SphereFile read(const std::string& bytes, const std::string& name, const SphereOptions& options = {}) {
  return readSpheres(fileOf(bytes, name), options);
}

/// What an error says behind the file's name.
std::string errorOf(const std::string& bytes, const std::string& name) {
  const std::string path = fileOf(bytes, name);
  const std::string text = inputError([&] { readSpheres(path); });
  EXPECT_EQ(text.substr(0, path.size() + 2), path + ": ");
  return text.substr(std::min(text.size(), path.size() + 2));
}

bool mentions(const std::vector<std::string>& notes, const std::string& text) {
  for (const std::string& note : notes) {
    if (note.find(text) != std::string::npos) return true;
  }
  return false;
}

std::string atom(const std::string& name, char chain, double x, double y, double z, const std::string& element) {
  return fmt::format("ATOM      1 {:<4} ASP {}1029    {:8.3f}{:8.3f}{:8.3f}  1.00 65.21          {:>2}  \n", name,
                     chain, x, y, z, element);
}

std::string biomt(int number, const std::array<std::array<double, 4>, 3>& rows) {
  std::string text;
  for (size_t row = 0; row < 3; ++row) {
    text += fmt::format("REMARK 350   BIOMT{}{:4}{:10.6f}{:10.6f}{:10.6f}     {:10.5f}\n", row + 1, number,
                        rows[row][0], rows[row][1], rows[row][2], rows[row][3]);
  }
  return text;
}

const std::string kPdb = "REMARK 350 BIOMOLECULE: 1\nREMARK 350 APPLY THE FOLLOWING TO CHAINS: A, B\n" +
                         biomt(1, {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}) +
                         biomt(2, {{{0, -1, 0, 10}, {1, 0, 0, 20}, {0, 0, 1, 30}}}) + atom(" CA ", 'A', 1, 2, 3, " C") +
                         atom(" N  ", 'B', -4.5, 5, 6, "") + atom(" O  ", 'C', 7, 8, 9, " O") + "END\n";

std::string npy(const std::string& type, const std::string& shape, const std::string& values, bool fortran = false) {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape + "), }";
  header.append(64 - (10 + header.size() + 1) % 64, ' ');
  header += '\n';
  return Bytes()
      .text("\x93NUMPY")
      .add(uint8_t(1))
      .add(uint8_t(0))
      .add(uint16_t(header.size()))
      .text(header + values)
      .str();
}

}  // namespace

TEST(ReadCsv, columnsByNumberAndByName) {
  const SphereFile plain = read("1,2,3\n4,5.5,-6e1\n", "a.csv");
  EXPECT_EQ(plain.spheres.centres, (std::vector<glm::vec3>{{1, 2, 3}, {4, 5.5f, -60}}));
  EXPECT_FLOAT_EQ(plain.spheres.radii[0], 63.0f / 200.0f);
  EXPECT_TRUE(mentions(plain.report.notes, "no radii in the file"));
  const SphereFile coloured = read("# some\n0 0 0 2 1 0.5 0\n\n1 1 1 3 1 0.5 0\n1 1 2 3 0 0 0\n", "a.csv");
  EXPECT_EQ(coloured.spheres.radii, (std::vector<float>{2, 3, 3}));
  EXPECT_EQ(coloured.spheres.materialOfSphere, (std::vector<uint32_t>{0, 0, 1}));
  EXPECT_EQ(coloured.spheres.materials[0].name, "#ff8000");
  EXPECT_NEAR(coloured.spheres.materials[0].linear.g, 0.2159f, 1e-4f);
  const SphereFile named =
      read("material;z;\"x\";y;Radius;mass\niron;3;1;2;0.5;9\ngold;6;4;5;0.25;9\niron;0;0;0;1;1\n", "a.csv");
  EXPECT_EQ(named.spheres.centres[1], glm::vec3(4, 5, 6));
  EXPECT_EQ(named.spheres.radii[1], 0.25f);
  EXPECT_EQ(named.spheres.materialOfSphere, (std::vector<uint32_t>{0, 1, 0}));
  EXPECT_EQ(named.spheres.materials[1].name, "gold");
  EXPECT_EQ(read("1,2,3,4\n", "a.csv", {.radius = 7.0f}).spheres.radii[0], 7.0f);
}

TEST(ReadCsv, whatCannotBeSeenIsCountedAndLeftOut) {
  const SphereFile file = read("0,0,0,1\nnan,0,0,1\n0,0,0,0\n0,0,0,-1\n0,inf,0,1\n0,0,0,nan\n1e300,0,0,1\n", "a.csv");
  EXPECT_EQ(file.report.fileSpheres, 7u);
  EXPECT_EQ(file.report.nonFinite, 4u);
  EXPECT_EQ(file.report.withoutRadius, 2u);
  EXPECT_EQ(file.spheres.centres.size(), 1u);
  EXPECT_EQ(errorOf("0,0,0,0\n", "a.csv"),
            "expected spheres, found none to see (1 in the file, 1 of radius 0 or below, 0 not finite)");
  errorOf("", "a.csv");
}

TEST(ReadCsv, saysWhere) {
  EXPECT_EQ(errorOf("1,2,3\n1,2\n", "a.csv"), "line 2: expected 3 fields, found 2");
  EXPECT_EQ(errorOf("1,2,3\n1,b,3\n", "a.csv"), "line 2: expected a place, a number, found 'b'");
  EXPECT_EQ(errorOf("1,2,3,4,2,0,0\n", "a.csv"), "line 1: expected a channel from 0 to 1, found 2");
  EXPECT_EQ(errorOf("x,y\n1,2\n", "a.csv"), "line 1: expected names of columns with x, y and z, or numbers");
  EXPECT_NE(errorOf("1,2,3,4,5,6\n", "a.csv").find("found 6 fields"), std::string::npos);
}

TEST(ReadXyz, theFirstFrame) {
  const SphereFile file = read("3\nwater\nO 0 0 0.5\nh 0 0.75 -0.25 extra\nXx 1 2 3\n1\nanother\nC 9 9 9\n", "a.xyz");
  EXPECT_EQ(file.spheres.centres, (std::vector<glm::vec3>{{0, 0, 0.5f}, {0, 0.75f, -0.25f}, {1, 2, 3}}));
  EXPECT_EQ(file.spheres.radii, (std::vector<float>{1.52f, 1.1f, 2.0f}));
  EXPECT_EQ(file.spheres.materials[0].name, "O");
  EXPECT_EQ(file.spheres.materials[1].linear, glm::vec3(1.0f));
  EXPECT_TRUE(mentions(file.report.notes, "only the first of several frames"));
  EXPECT_TRUE(mentions(file.report.notes, "1 atoms of unknown elements"));
  EXPECT_EQ(errorOf("3\n\nO 0 0 0\n", "a.xyz"), "line 3: expected 3 atoms, found the end of the file after 1");
  EXPECT_EQ(errorOf("99999999999999999999\n\nO 0 0 0\n", "a.xyz"),
            "line 1: expected the number of atoms, found '99999999999999999999'");
  EXPECT_EQ(errorOf("1\n\nO 0 zero 0\n", "a.xyz"), "line 3: expected a place, a number, found 'zero'");
}

TEST(ReadPdb, copiesOfTheAssembly) {
  const SphereFile whole = read(kPdb, "a.pdb");
  EXPECT_EQ(whole.report.fileSpheres, 3u);
  EXPECT_EQ(whole.report.copies, 2u);
  // The second copy: turned by 90 degrees about z, then shifted. Chain C is not in the assembly.
  EXPECT_EQ(whole.spheres.centres,
            (std::vector<glm::vec3>{{1, 2, 3}, {-4.5f, 5, 6}, {10 - 2, 20 + 1, 33}, {10 - 5, 20 - 4.5f, 36}}));
  EXPECT_EQ(whole.spheres.radii, (std::vector<float>{1.7f, 1.55f, 1.7f, 1.55f}));
  EXPECT_TRUE(mentions(whole.report.notes, "1 atoms of chains"));
  const SphereFile part = read(kPdb, "a.pdb", {.copies = false});
  EXPECT_EQ(part.spheres.centres.size(), 3u);
  EXPECT_EQ(part.spheres.materials[2].name, "O");
}

TEST(ReadPdb, elementsByNameAndModels) {
  const std::string text = "MODEL        1\n" + atom(" CA ", 'A', 0, 0, 0, "") + atom("CA  ", 'A', 9, 0, 0, "") +
                           atom("1HB ", 'A', 5, 0, 0, "") + "ENDMDL\nMODEL        2\n" +
                           atom(" C  ", 'A', 1, 1, 1, " C") + "ENDMDL\n";
  const SphereFile file = read(text, "a.ent");
  ASSERT_EQ(file.spheres.centres.size(), 3u);
  EXPECT_EQ(file.spheres.materials[file.spheres.materialOfSphere[0]].name, "C");
  EXPECT_EQ(file.spheres.materials[file.spheres.materialOfSphere[1]].name, "Ca");
  EXPECT_EQ(file.spheres.materials[file.spheres.materialOfSphere[2]].name, "H");
  EXPECT_TRUE(mentions(file.report.notes, "only the first of several models"));
  EXPECT_TRUE(mentions(file.report.notes, "no END record"));
}

TEST(ReadPdb, nonsense) {
  EXPECT_EQ(errorOf("this is no protein\n", "a.pdb"), "expected ATOM or HETATM records, found none");
  EXPECT_EQ(errorOf("ATOM  and nothing more\n", "a.pdb"),
            "line 1: expected an atom of at least 54 columns and an end of the line, found 22");
  std::string text = atom(" CA ", 'A', 0, 0, 0, " C");
  text.replace(38, 8, "  twelve");
  EXPECT_EQ(errorOf(text, "a.pdb"), "line 1: expected a place in columns 39 to 46, a number, found 'twelve'");
  EXPECT_EQ(errorOf("REMARK 350   BIOMT2   1  1.0 0.0 0.0 0.0\n" + kPdb, "a.pdb"),
            "line 1: expected the rows BIOMT1, BIOMT2, BIOMT3 in order, found BIOMT2");
  EXPECT_NE(errorOf("REMARK 350   BIOMT1   1  1.0 0.0 0.0 0.0\n" + atom(" CA ", 'A', 0, 0, 0, " C"), "a.pdb")
                .find("expected rows BIOMT1 to BIOMT3 of every copy"),
            std::string::npos);
}

TEST(ReadNpy, typesAndOrders) {
  Bytes rows, columns(ByteOrder::big);
  for (const float value : {1.0f, 2.0f, 3.0f, 0.5f, 4.0f, 5.0f, 6.0f, 0.25f})
    rows.add(value);
  for (const double value : {1.0, 4.0, 2.0, 5.0, 3.0, 6.0, 0.5, 0.25})
    columns.add(value);
  for (const std::string& bytes : {npy("<f4", "2, 4", rows.str()), npy(">f8", "2, 4", columns.str(), true)}) {
    for (const std::string& file : {bytes, gzip(bytes)}) {
      const SphereFile read = readSpheres(fileOf(file, "a.npy"));
      EXPECT_EQ(read.spheres.centres, (std::vector<glm::vec3>{{1, 2, 3}, {4, 5, 6}}));
      EXPECT_EQ(read.spheres.radii, (std::vector<float>{0.5f, 0.25f}));
    }
  }
}

TEST(ReadNpy, absurdShapes) {
  const std::string values(48, '\0');
  EXPECT_NE(errorOf(npy("<f4", "3, 5", values), "a.npy").find("expected rows of 3"), std::string::npos);
  EXPECT_NE(errorOf(npy("<f4", "12,", values), "a.npy").find("expected an array of 2 axes, found 1"),
            std::string::npos);
  EXPECT_NE(errorOf(npy("<f4", "4000000000000000000, 4", values), "a.npy").find("found at most 48 bytes"),
            std::string::npos);
  EXPECT_NE(errorOf(npy("<f4", "1000000000, 3", values), "a.npy").find("found at most 48 bytes"), std::string::npos);
  EXPECT_NE(errorOf(npy("<i4", "4, 3", values), "a.npy").find("expected floating point numbers"), std::string::npos);
  EXPECT_NE(errorOf(npy("<f4", "3, 3", values), "a.npy").find("found more"), std::string::npos);
}

TEST(ReadSpheres, everyTruncationIsRefusedOrSaysSo) {
  Bytes rows;
  for (const float value : {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f})
    rows.add(value);
  for (const std::string& bytes : {npy("<f4", "2, 3", rows.str()), gzip(npy("<f4", "2, 3", rows.str()))}) {
    const std::string path = fileOf(bytes, "a.npy");
    expectTruncationsFail(path, [&] { readSpheres(path); });
  }
  const std::string xyz = "3\nwater\nO 0 0 0.5\nH 0 0.75 -0.25\nH 1 2 3\n";
  const std::string path = fileOf(xyz, "a.xyz");
  expectTruncationsFail(path, [&] { readSpheres(path); });
  // Formats without a count: what is read are whole lines, and of a PDB it is said that its end is missing.
  const auto wholeLines = [](const std::string& bytes, const std::string& name, size_t perLine) {
    const std::string file = fileOf(bytes, name);
    for (size_t length = 0; length < bytes.size(); ++length) {
      const std::string part = bytes.substr(0, length);
      writeBytes(file, part);
      try {
        const SphereFile read = readSpheres(file, {.radius = 1.0f, .copies = false});
        const auto lines = size_t(std::count(part.begin(), part.end(), '\n'));
        EXPECT_LE(read.spheres.centres.size(), lines / perLine) << name << " cut to " << length;
        if (name == "a.pdb" && part.find("END") == std::string::npos) {
          EXPECT_TRUE(mentions(read.report.notes, "no END record")) << length;
        }
      } catch (const InputError&) {
      }
    }
  };
  wholeLines("1,2,3,iron\n4,5,6,gold\n", "a.csv", 1);
  wholeLines(kPdb, "a.pdb", 1);
}

}  // namespace freevoxel::test::read_spheres_tests
