// A folder for results.
#pragma once

#include <filesystem>
#include <string_view>

namespace kilvo::cli {

/// Creates the folder if need be and makes sure that files can be written in it. Throws lab::OutputError.
void prepare_folder(const std::filesystem::path& folder);

/// Files of two programs at once would be a mixture: until this one ends, however it ends, no other may claim the folder. Once for each
/// folder. Throws lab::OutputError.
void claim_folder(const std::filesystem::path& folder);

/// Writes a whole file at once, with a newline at its end. Throws lab::OutputError.
void write_text_file(const std::filesystem::path& path, std::string_view text);

/// Removes what an earlier run wrote there: files of two runs side by side would be taken for one.
void remove_results(const std::filesystem::path& folder);

}  // namespace kilvo::cli
