// What real robots have and the ideal one has not. All zero: the ideal robot, to the byte.
#pragma once

namespace kilvo::lab {

struct WearModel {
  double sole_motion = 0;   // m: a loaded sole gives way by so much within a stance, sideways, and a third of it down
  double shock = 0;         // m/s: sigma of the velocity that a leg's encoders seem to show at its touchdown, at the foot, for some 10 ms
  double impact = 0;        // m/s^2: the torso rings so hard at each touchdown; 0: as hard as the walk says
  double flex = 0;          // rad: the joints give way by so much under 100 N m, behind the encoders
  double backlash = 0;      // rad: the play of each joint; the torque presses the encoder to one side of it
  double zero_offset = 0;   // rad: sigma of each encoder's zero; 0: that of the joint model
  double link_length = 0;   // sigma of the true lengths of thighs and shins, as a share; the URDF has the nominal ones
  double velocity_lag = 0;  // s: time constant of a low pass on the joint velocities
  double stamp_jitter = 0;  // s: sigma of the joint stamps; they never go back
  double lost = 0;          // share of joint and IMU messages that do not come
  double repeated = 0;      // share of joint and IMU messages that come twice
  double legs_lost = 0, legs_repeated = 0;  // the same of joint messages alone, on top of that
  double vibration = 0;  // m/s^2: rms of the torso's vibration on each axis while it walks, 45 to 90 Hz: a slow IMU aliases it
};

}  // namespace kilvo::lab
