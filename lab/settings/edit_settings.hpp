// Changes single values in the text of a configuration file; comments, order and everything else stay as they are.
#pragma once

#include <string>

namespace kilvo::lab {

/// The text with `key` ("lidar.T_imu_lidar.p") set to `value` (YAML). A key that is not there is added to its section. Throws ConfigError
/// when the section is not there either, or the text is not YAML.
std::string with_setting(const std::string& yaml, const std::string& key, const std::string& value);

}  // namespace kilvo::lab
