"""What an exported correction is worth: its gap in MuJoCo, and the band of its samples."""
