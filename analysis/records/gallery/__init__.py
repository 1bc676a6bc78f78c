"""Robot files of known robots from published dimensions and datasheets: `clie robot --gallery`."""

from pathlib import Path

FOLDER = Path(__file__).parent
ROBOTS = {
    "paper-arm": "the two-link arm of the paper, its motors, gears and gains",
    "pendulum": "torque-limited simple pendulum of DFKI, T-Motor AK80-6",
    "double-pendulum": "double pendulum of DFKI, two AK80-6, design C.1",
    "emps": "EMPS benchmark: a carriage on a ball screw under cascaded control",
    "cycloidal": "printed cycloidal joint of 13:1 with a moteus drive",
    "xl330": "Dynamixel XL330-M288 with the pendulum of the BAM bench",
    "so101": "SO-101: six Feetech STS3215 servos",
    "go2-leg": "front left leg of a Unitree Go2, three joints",
    "ur5e": "Universal Robots UR5e, six axes",
    "ur10e": "Universal Robots UR10e, six axes",
    "panda": "Franka Emika Panda, seven axes",
    "xarm7": "UFACTORY xArm 7, seven axes",
    "gen3": "Kinova Gen3, seven axes"}


def gallery_files(name: str, robot_file: str) -> dict[str, str]:
    """Return the texts of a robot's files by their names, its robot file under the given one."""
    texts = {robot_file: (FOLDER / f"{name}.toml").read_text()}
    model = FOLDER / f"{name}.urdf"
    return texts | ({model.name: model.read_text()} if model.exists() else {})
