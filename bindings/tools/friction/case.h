// A case of `deform friction`: what drives the contact, with which parameters, and what is wanted of it. The
// form is that of the reference set.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace cli {

// by input.kind, in the order of kDriveNames
enum class Drive { force, velocity, spring, ramps, path, circle, turn, loaded };

struct CaseParam {
  std::string key;
  std::vector<double> value;  // empty where it is a word
  std::string word;
};

struct FrictionCase {
  std::string file, id, law, kind;
  Drive drive = Drive::force;
  double mass = 0, gravity = 0, normal_force = 0;  // 0 where the case gives none
  double x0 = 0, v0 = 0, z0[2] = {};
  std::map<std::string, double> input;  // the numbers of the drive, the optional ones too
  std::vector<CaseParam> params;        // without those that are null
  std::vector<double> times;            // of the rows, rising; of ramps: the rates; of a path: empty
  std::vector<double> path_x, path_segment;
  double path_speed = 0;
  std::vector<std::string> columns;

  const CaseParam *param(const std::string &key) const;
  double number_of(const std::string &key, double otherwise) const;  // a parameter's
};

// Throws Failure with exit code 2 and one sentence: file, JSON pointer, what was expected.
FrictionCase read_case(const std::string &file);

}  // namespace cli
