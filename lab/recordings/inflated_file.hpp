// A file that is compressed as a whole (.mcap.zstd, .db3.zstd): inflated piece by piece into a file without a name, which is gone with its
// reader, since a recording is not read from its beginning to its end only.
#pragma once

#include <optional>

#include "lab/recordings/file_bytes.hpp"
#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

struct InflatedFile {
  FileBytes file;
  std::optional<Damage> damage;  // what was inflated before it is in `file`
};

/// Begins as a zstd frame does.
bool is_zstd_file(const FileBytes& file);

/// Throws InputError when there is no room for it.
InflatedFile inflate_file(const FileBytes& compressed);

}  // namespace kilvo::lab
