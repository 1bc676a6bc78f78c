"""Parts of the pictures: what a diagram contains, where each thing goes, how it is painted.

A picture is made in this order: `single` makes a diagram of a block that stands alone, `graph`
reads it, `icons` finds what a block looks like, `canonical` lists blocks and wires in one order,
`hints` hold what is asked for or stood there before, `shapes` sizes it, `layers` gives each block
its column and breaks feedback, `channels` lists what meets between two columns, `order` sorts each
column, `routing` aligns the nodes and gives each wire its lane, `labels` writes the texts,
`layout` puts these together into a `plan`, `paint` draws it, and `words` say what it shows.
"""
