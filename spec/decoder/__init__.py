"""A second, independent decoder of the `.gip` image format.

It was written from the specification alone (`spec/gip.md`); "section N" in the comments is a section of it. It is slow
and meant to be read beside the specification:

| module       | sections   | content                                               |
| ------------ | ---------- | ----------------------------------------------------- |
| errors       | 1          | kinds of error                                        |
| arith        | 2, 3       | binary32, exp, sin and cos                            |
| container    | 4.1 - 4.3  | signature, numbers, chunks, CRC                       |
| header       | 5.1 - 5.3, 6 | header, quantizers, steps                           |
| metadata     | 5.5, 5.6   | colours, texts, Exif, bounds of layers                |
| packed       | 6, 7.1, 7.2 | a layer of the packed coding                         |
| entropy      | 7.3        | the entropy coder                                     |
| tree         | 7.4        | a layer of the entropy coding: tree and codes         |
| values       | 7.5        | codes of the entropy coding to values                 |
| model        | 8          | shapes, what is drawn                                 |
| decode       | 4.3, 4.4, 5.4, 5.7, 11 | order of chunks and of errors, what is skipped or kept |
| render       | 9.1 - 9.4  | request, grid, sum of the Gaussians                   |
| samples      | 9.5, 9.6   | averages, integers, wider colour models               |
| texture      | 9.7        | texture                                               |
| limits       | 10         | limits                                                |
| work         | 10         | work of a rendering                                   |
| pnm          | -          | PGM, PPM and PAM                                      |
| check        | 13         | comparison with the test vectors                      |
| compare      | -          | results for any files, for comparison with another program |
"""
