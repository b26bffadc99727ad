// livox_ros_driver/CustomMsg and livox_ros_driver2/CustomMsg, which have the same layout.
#pragma once

#include "lab/messages/point_cloud2.hpp"

namespace kilvo::lab {

/// There is one convention only (offset_time, uint32 nanoseconds from timebase), but the times may be missing: all equal.
Decoded<PointTimeFormat> detect_livox_point_time(const std::vector<CloudTimes>& clouds);

/// The scan's time is the header's stamp, or timebase when the stamp is 0. The offsets count from that time: where timebase and stamp
/// are on one clock their difference is added, where they are not, timebase is taken to be the stamp. Reflectivity becomes intensity.
/// With TimeReference::none all offsets are 0.
Decoded<DecodedScan> decode_livox(const WireMessage& message, const PointTimeFormat& format);

/// What detect_point_time() needs from one message.
Decoded<CloudTimes> observe_livox(const WireMessage& message);

}  // namespace kilvo::lab
