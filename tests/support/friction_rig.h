// `deform friction` as tests call it: its rows by column, its figures by name, and the numbers of the
// reference set.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <vector>

#include "support.h"

namespace test::rig {

struct Rows {
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;
  bool has(const std::string &name) const {
    return std::find(names.begin(), names.end(), name) != names.end();
  }
  std::vector<double> column(const std::string &name) const {
    const auto at = size_t(std::find(names.begin(), names.end(), name) - names.begin());
    EXPECT_LT(at, names.size()) << "no column " << name;
    std::vector<double> out;
    for (const auto &row : values) out.push_back(at < row.size() ? row[at] : NAN);
    return out;
  }
};

inline Rows read_rows(const std::string &csv) {
  Rows rows;
  const std::vector<std::vector<std::string>> cells = read_csv(csv);
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i == 0) {
      rows.names = cells[0];
      continue;
    }
    rows.values.emplace_back();
    for (const std::string &cell : cells[i]) rows.values.back().push_back(std::strtod(cell.c_str(), nullptr));
  }
  return rows;
}

// The number behind the last of these keys, each looked for behind the one before; NaN where
// one is not there.
inline double json_number(const std::string &text, std::initializer_list<const char *> keys) {
  size_t at = 0;
  for (const char *key : keys) {
    const std::string quoted = '"' + std::string(key) + '"';
    at = text.find(quoted, at);
    if (at == std::string::npos) return NAN;
    at += quoted.size();
  }
  return std::strtod(text.c_str() + text.find_first_not_of(" \t\r\n:[", at), nullptr);
}

struct Outcome {
  Rows rows;
  std::string figures, err;  // JSON text
  int exit_code = 0;
  double figure(const char *name) const { return json_number(figures, {name}); }
};

inline std::string example(const std::string &name) {
  return std::string(DEFORM_SOURCE_DIR) + "/examples/friction/" + name + ".json";
}

inline Outcome run(const std::string &file, std::vector<std::string> more = {}) {
  static int count = 0;
  const std::string csv =
      scratch("friction_rig") + "/" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".csv";
  std::vector<std::string> args = {"friction", file, "--csv", csv, "--json"};
  args.insert(args.end(), more.begin(), more.end());
  const CommandResult r = deform(args);
  Outcome out;
  out.exit_code = r.exit_code;
  out.figures = r.out;
  out.err = r.err;
  EXPECT_EQ(r.exit_code, 0) << r.err;
  out.rows = read_rows(csv);
  unlink(csv.c_str());
  return out;
}

}  // namespace test::rig
