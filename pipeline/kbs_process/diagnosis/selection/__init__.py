"""From candidate effects to what a diagnosis reports."""
