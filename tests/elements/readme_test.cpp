// elements/README.md says what the registry holds.
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "elements/registry.hpp"

namespace halfgrad {
namespace {

const std::string elements_directory = std::string(PROJECT_SOURCE_DIR) + "/elements/";

std::vector<std::string> lines_of(const std::string& name) {
  std::ifstream file(elements_directory + name);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

// The cells of the rows that follow the table's head, blanks removed.
std::set<std::vector<std::string>> table_rows(const std::vector<std::string>& lines) {
  std::set<std::vector<std::string>> rows;
  bool in_body = false;
  for (std::string line : lines) {
    if (line.starts_with("|---")) {
      in_body = true;
    } else if (in_body && line.starts_with("|")) {
      std::erase(line, ' ');
      std::vector<std::string> cells;
      std::stringstream stream(line.substr(1));
      for (std::string cell; std::getline(stream, cell, '|');) cells.push_back(cell);
      rows.insert(cells);
    }
  }
  return rows;
}

// The comment that opens a header.
std::string opening_picture(const std::string& header) {
  std::string picture;
  for (const std::string& line : lines_of(header)) {
    if (!line.starts_with("//")) break;
    picture += line.substr(2) + '\n';
  }
  return picture;
}

TEST(ElementsReadme, TableHasOneRowAnElement) {
  std::set<std::vector<std::string>> expected;
  Elements::for_each([&]<class E>() {
    const std::string name(E::name);
    expected.insert({"[" + name + "](" + name + ".hpp)", std::to_string(E::dim), std::to_string(E::num_nodes),
                     std::to_string(E::facets.size()), std::to_string(E::vtk_id), E::affine ? "yes" : "no"});
  });
  EXPECT_EQ(table_rows(lines_of("README.md")), expected);
}

TEST(ElementsReadme, PicturesAreThoseOfTheHeaders) {
  std::string readme;
  for (const std::string& line : lines_of("README.md")) readme += line + '\n';
  Elements::for_each([&]<class E>() {
    const std::string picture = opening_picture(std::string(E::name) + ".hpp");
    for (int i = 0; i < E::num_nodes; ++i)
      EXPECT_NE(picture.find(std::to_string(i)), std::string::npos) << "node " << i << " of " << E::name;
    EXPECT_NE(readme.find("```\n" + picture + "```"), std::string::npos) << "picture of " << E::name << ":\n"
                                                                         << picture;
  });
}

}  // namespace
}  // namespace halfgrad
