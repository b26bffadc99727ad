// The page that shows a run: HTML, style and script in one text, put together from lab/report/page/ when the program is built.
#pragma once

#include <string_view>

namespace kilvo::lab {

/// What stands in the page where the figures go.
inline constexpr std::string_view report_data_marker = "{{data}}";

/// The whole page, with report_data_marker in it once.
std::string_view report_page();

}  // namespace kilvo::lab
