// Drives the system of one joint as the engine does: rows of q, dq and force; `force` afterwards.
#include "j1_gazebo.cc"

extern "C" int run(int count, double every, const char *joint, const char *per_force,
                   const double *rows, double *force)
{
  gz::sim::EntityComponentManager ecm;
  gz::sim::EventManager events;
  gz::sim::UpdateInfo info;
  auto element = std::make_shared<sdf::Element>();
  ecm.joints["elbow"] = 7;
  element->texts = {{"joint_name", joint}, {"command_per_force", per_force}};
  corrected::J1 system;
  system.Configure(1, element, ecm, events);
  info.dt = std::chrono::nanoseconds(std::lround(1e9 * every));
  system.PreUpdate(info, ecm);  // nothing is known of the joint yet: its components are made
  auto *position = ecm.Component<gz::sim::components::JointPosition>(7);
  auto *velocity = ecm.Component<gz::sim::components::JointVelocity>(7);
  auto *command = ecm.Component<gz::sim::components::JointForceCmd>(7);
  if (!position || !velocity || !command) return 1;
  for (int pass = 0; pass < 2; pass++)  // the second one, after a reset, gives the same
  {
    info.simTime = std::chrono::nanoseconds(0);
    system.Reset(info, ecm);
    for (int i = 0; i < count; i++)
    {
      info.simTime += info.dt;
      position->Data() = {rows[3 * i]};
      velocity->Data() = {rows[3 * i + 1]};
      command->Data() = {rows[3 * i + 2]};
      system.PreUpdate(info, ecm);
      force[i] = command->Data()[0];
    }
  }
  return 0;
}
