// What standing legs say of the acceleration against what the accelerometer says: sizes of the legs and the IMU's mount on the robot
// without any other sensor and on any ground. While a sole stands, the joints and the gyro give the IMU's way over it, whose second
// differences must be those of the specific force and gravity. R. Frisch, "Statistical confluence analysis", 1934: where both are noisy,
// the true ratio lies between the regression of the one on the other and that of the other on the one.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "lab/doctor/gyro_path.hpp"
#include "lab/doctor/leg_path.hpp"

namespace kilvo::lab {

struct LegAcceleration {
  bool good = false;                    // enough steps
  double offset = 0, offset_sigma = 0;  // s: the legs' stamps plus this are on the IMU's clock
  double explained = 0;                 // squared correlation of the two accelerations, without what the unknowns beside the scale explain
  double least_scale = 0;               // size of the legs as described through their size as the accelerometer has it: between these
  double most_scale = 0;                //
  double scale_sigma = 0;               // of either
  Eigen::Vector3d turn, sigma;          // rad, frame of the link: true mount of the link on the IMU = described * Exp(turn)
  std::size_t rows = 0;                 // 0: too few
  double independent = 0;               // values in them that do not depend on each other
  double acceleration = 0;              // m/s^2: rms of the accelerometer's
  double noise = 0;                     // share of the accelerometer's square that the noise of encoders and stamps has in what differs
  double contradicts = 0;               // as differs(), good or not, without that noise; of legs that neither move nor turn 1
  /// Squared difference of the two accelerations by the accelerometer's squared, with legs of the described size: small only where both
  /// belong together and the size is right.
  double differs() const { return good ? 1 + least_scale * (most_scale - 2) : INFINITY; }
  /// rad: by what soles that roll turn the mount. On 34 right walks of levels 0 to 2 it was turned by 1.2 times as much (rms), at most
  /// by 2.6.
  double mount_method() const { return 0.0087 + 0.175 * (1 - explained); }
};

class ForceIntegral;

/// What the accelerometer measured along the turns of the gyro, for any number of fits.
struct MeasuredForce {
  /// `imu`: SI units, IMU frame.
  MeasuredForce(const std::vector<InertialSample>& imu, GyroPath turns);
  GyroPath gyro;
  std::shared_ptr<const ForceIntegral> integral;
};

/// `path`: both feet in the frame of the link. Starts from `offset` (s).
LegAcceleration fit_leg_acceleration(const std::vector<LegPose>& path, const MeasuredForce& measured, const SE3& T_link_imu, double offset);

}  // namespace kilvo::lab
