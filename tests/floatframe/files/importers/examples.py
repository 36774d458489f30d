"""Systems, bodies and helpers that several tests share: urdf files."""

GRIPPER = """<?xml version="1.0"?>
<robot name="gripper" xmlns:xacro="http://ros.org/wiki/xacro">
  <material name="blue"><color rgba="0.2 0.4 0.8 0.5"/></material>
  <link name="world"/>
  <link name="rail">
    <inertial><origin xyz="0.1 0 0.02" rpy="0 0.3 0"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
    <visual><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.05" length="0.2"/></geometry>
      <material name="blue"/></visual>
    <visual name="plate"><geometry><box size="0.1 0.2 0.3"/></geometry></visual>
    <collision><geometry><sphere radius="0.2"/></geometry></collision>
  </link>
  <link name="finger">
    <inertial><mass value="0.3"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>
    <visual><geometry><mesh filename="package://hand/meshes/tip.stl" scale="0.001 0.001 -0.001"/></geometry></visual>
  </link>
  <link name="thumb">
    <inertial><mass value="0.2"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>
  </link>
  <link name="tip"/>
  <joint name="slide" type="prismatic">
    <parent link="world"/><child link="rail"/><origin xyz="0 0 1" rpy="0.1 0.2 0.3"/><axis xyz="0 0 2"/>
    <limit lower="-0.1" upper="0.5" effort="30" velocity="0.2"/><dynamics damping="4" friction="0.5"/>
  </joint>
  <joint name="knuckle" type="revolute">
    <parent link="rail"/><child link="finger"/><origin xyz="0 0.1 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-0.2" upper="0.9" effort="2" velocity="3"/>
  </joint>
  <joint name="other" type="revolute">
    <parent link="rail"/><child link="thumb"/><origin xyz="0 -0.1 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="0.5" effort="2" velocity="3"/><mimic joint="knuckle" multiplier="-2" offset="0.3"/>
  </joint>
  <joint name="end" type="fixed"><parent link="finger"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
  <gazebo reference="rail"/><transmission name="t"/><gazebo/>
</robot>
"""
