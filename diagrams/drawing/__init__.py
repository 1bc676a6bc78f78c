"""Parts of the pictures: what a diagram contains, where each thing goes, how it is painted.

A picture is made in this order: `graph` reads the diagram, `icons` finds what a block looks like,
`shapes` sizes it, `layers` gives each block its column and breaks feedback, `channels` lists what
meets between two columns, `order` sorts each column, `routing` aligns the nodes and gives each
wire its lane, `labels` writes the texts, `layout` puts these together into a `plan`, and `paint`
draws it.
"""
