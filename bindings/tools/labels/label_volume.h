// A volume of labels: one whole number per voxel, as segmentation programs write it, and where it lies.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "label_math.h"

namespace labels {

// A file holds at most this many beside 0; an image of gray values holds more.
constexpr size_t kMaxLabels = 1024;

struct Volume {
  std::array<uint32_t, 3> size{};  // voxels per axis; the first axis runs fastest
  double origin[3] = {0, 0, 0};    // m, center of the first voxel
  double axis[3][3] = {};          // m, from a voxel's center to that of its next along axis k
  std::vector<uint16_t> voxel;     // index into `value`
  std::vector<int64_t> value;  // labels as the file has them, ascending; 0 is always the first listed here
  std::map<int64_t, std::string> name;  // those that the file names
  std::vector<std::string> notes;       // what was assumed, one sentence each

  size_t voxels() const { return size_t(size[0]) * size[1] * size[2]; }
  // m3 of one voxel; below 0 where the axes are left-handed.
  double cell() const;
  std::array<Vec, 3> inverse() const;  // rows that give voxels for meters
};

// How a header says that its voxels are stored.
struct Encoding {
  uint32_t bytes = 0;  // of a value: 1, 2, 4, 8
  bool is_signed = false, big_endian = false, compressed = false;
};

// Reads a .nrrd, .nhdr, .mha or .mhd file; its content says which it is. Throws cli::Failure with one
// sentence: the file, the line or field, what to do.
// unit: m that a length of 1 in the file has; 0: as the file says, else millimeters with a note
Volume read_labels(const std::string &path, double unit = 0);

// The same for bytes in memory. path: for messages, and the folder of a data file; empty: none allowed
Volume read_labels(const std::string &path, std::string_view bytes, double unit);

// ---- parts of the readers ----

// A header and the bytes behind it.
struct Stored {
  Volume volume;  // all but voxel and value
  Encoding encoding;
  std::string file;            // with the voxels, as the header names it; empty: they follow the header
  int64_t skip = 0;            // bytes before the data; -1: the data are the last bytes
  uint64_t skip_unpacked = 0;  // bytes of what is unpacked
  uint32_t skip_lines = 0;
  size_t data_at = 0;  // where the header ends
  double unit = 0;     // m; 0: the header does not say
};
[[noreturn]] void refuse(const std::string &path, const char *sentence, ...)
    __attribute__((format(printf, 2, 3)));
Stored read_nrrd(const std::string &path, std::string_view bytes);
Stored read_metaimage(const std::string &path, std::string_view bytes);

// Words of a header. Numbers do not depend on the locale.
std::string_view trimmed(std::string_view text);
std::string lower(std::string_view text);
std::vector<std::string_view> words(std::string_view text);
bool to_number(std::string_view text, double &out);
bool to_number(std::string_view text, int64_t &out);
std::string quoted_part(std::string_view text);  // for sentences: in quotes, one line, at most 40 characters
// m; 0 for a name that is no unit of length
double unit_of(std::string_view name);

}  // namespace labels
