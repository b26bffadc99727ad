// A folder for results.
#pragma once

#include <filesystem>
#include <string_view>

namespace kilvo::cli {

/// Creates the folder if need be and makes sure that files can be written in it. Throws lab::OutputError.
void prepare_folder(const std::filesystem::path& folder);

/// Writes a whole file at once, with a newline at its end. Throws lab::OutputError.
void write_text_file(const std::filesystem::path& path, std::string_view text);

/// Removes what an earlier run wrote there: files of two runs side by side would be taken for one.
void remove_results(const std::filesystem::path& folder);

}  // namespace kilvo::cli
