// Subcommands that are programs of their own, beside the command.
#pragma once
#include <string>
#include <vector>

namespace cli {

class Command;
struct Globals;

std::string beside(const std::string &name);  // the path of a program in the folder of this one

// Python interpreters, the first choice first: the one that DEFORM_PYTHON in the environment names, and no
// other; else the one that the build found, and python3 in PATH.
std::vector<std::string> pythons();

// Becomes the program `name`, with these words behind its own, or throws; missing: what to do where it is not
// there.
[[noreturn]] void become(const std::string &subcommand, const std::string &name,
                         const std::vector<std::string> &words, const std::string &missing);

#ifdef _WIN32
inline constexpr const char *kMadeByTools = "the build for Windows has none; see doc/howto/packages.md";
inline constexpr const char *kNoServer = kMadeByTools, *kNoWindow = kMadeByTools, *kNoContact = kMadeByTools;
#else
inline constexpr const char *kMadeByTools = "`make demo` leaves it out, `make tools` builds it";
inline constexpr const char *kNoServer = "with Debian's libwebsockets-dev installed, `make tools` builds it";
inline constexpr const char *kNoWindow =
    "with Debian's libglfw3-dev and libimgui-dev installed, `make view` builds it";
inline constexpr const char *kNoContact =
    "it is not installed: with Debian's libhdf5-dev, the library's build makes it";
#endif

// A subcommand whose command line its program reads, by the same rules (bindings/tools, bindings/view,
// bindings/serve).
struct Program {
  const char *name, *file, *about;
  const char *missing = kMadeByTools;
};
void add_program(Command parent, const Globals &globals, const Program &program);

inline constexpr Program kCalibrate = {
    "calibrate", "deform-cost", "measures costs and errors of the models on this machine, for the planner"};
inline constexpr Program kCcd = {"ccd", "deform-ccd",
                                 "times of impact of point-triangle and edge-edge queries"};
inline constexpr Program kCost = {
    "cost", "deform-cost",
    "what accuracy costs on a scene: models, steps, meshes, contact against a fine reference"};
inline constexpr Program kFriction = {
    "friction", "deform-friction",
    "runs a friction law on a rig: a driven mass, a prescribed slip, a spring, ramps"};
inline constexpr Program kCheck = {
    "check", "deform-check",
    "checks a plugin by rules, each in a separate process; exit code 1 if one is broken"
#ifndef DEFORM_HAVE_CHECK
    ,
    "it opens plugin files, and this command was built to load none (DEFORM_PLUGINS_STATIC)"
#endif
};
inline constexpr Program kFromLabels = {
    "from-labels", "deform-labels",
    "a segmented scan (a volume of labels) as closed surfaces, bodies, obstacles and a scene"};
inline constexpr Program kPhantom = {
    "phantom", "deform-labels",
    "a volume of labels made from ellipsoids and cylinders, with the volumes that these have"};
inline constexpr Program kRollback = {
    "rollback", "deform-rollback",
    "runs a scene by the collision solution of Zerbato (2010), for comparison"};
inline constexpr Program kServe = {"serve", "deform-serve",
                                   "a scene in a browser on this machine: orbit, pull, cut, sliders, plots",
                                   kNoServer};
inline constexpr Program kView = {"view", "deform-view", "a window on a scene, with mouse, sliders and plots",
                                  kNoWindow};
inline constexpr const char *kSweepAbout = "runs a scene over ranges of its values: tables, plots, a page";
inline constexpr const char *kFitAbout = "finds values of a scene from measured curves, with intervals";

}  // namespace cli
