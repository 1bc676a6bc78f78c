"""Links of a drawn arm as the model file that its owner has: URDF or MJCF."""

from collections.abc import Iterable

from clie_blocks.analysis.blind.engine.spatial_links import SpatialLinks

TOOL = "tool"


def model_text(links: SpatialLinks) -> str:
    """Return the text of the file that states the links, see `SpatialLinks.file`."""
    return _mjcf(links) if links.file.endswith(".xml") else _urdf(links)


def _urdf(links: SpatialLinks) -> str:
    parts = ['<robot name="arm">', '  <link name="base"/>']
    for k in range(links.n):
        xx, yy, zz = links.inertia[k]
        parts += [
            f'  <link name="link_{k + 1}"><inertial>',
            f'    <origin xyz="{_triple(links.com[k])}"/><mass value="{links.mass[k]}"/>',
            f'    <inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>',
            '  </inertial></link>',
            f'  <joint name="joint_{k + 1}" type="continuous">',
            f'    <parent link="{f"link_{k}" if k else "base"}"/><child link="link_{k + 1}"/>',
            f'    <origin xyz="{_triple(links.at(k))}"/><axis xyz="{_triple(links.axis[k])}"/>',
            '  </joint>']
    return "\n".join([
        *parts, f'  <link name="{TOOL}"/>', '  <joint name="flange" type="fixed">',
        f'    <parent link="link_{links.n}"/><child link="{TOOL}"/>',
        f'    <origin xyz="{_triple(links.end[-1])}"/>', '  </joint>', '</robot>', ''])


def _mjcf(links: SpatialLinks) -> str:
    inside = f'<body name="{TOOL}" pos="{_triple(links.end[-1])}"/>'
    for k in reversed(range(links.n)):
        inside = "\n".join([
            f'<body name="link_{k + 1}" pos="{_triple(links.at(k))}">',
            f'  <joint name="joint_{k + 1}" axis="{_triple(links.axis[k])}"/>',
            f'  <inertial pos="{_triple(links.com[k])}" mass="{links.mass[k]}" '
            f'diaginertia="{_triple(links.inertia[k])}"/>', inside, '</body>'])
    return "\n".join(['<mujoco model="arm">', '<compiler angle="radian"/>', '<worldbody>', inside,
                      '</worldbody>', '</mujoco>', ''])


def _triple(values: Iterable[float]) -> str:
    return " ".join(f"{value:.10g}" for value in values)
